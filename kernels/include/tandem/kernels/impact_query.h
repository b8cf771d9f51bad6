#pragma once
#include <cstdint>
#include <span>

#include "tandem/kernels/detail/question.h"
#include "tandem/kernels/motion.h"

namespace tandem {

enum class ImpactStatus : std::uint8_t {
  none = 0,      ///< surely no contact in the whole step
  found = 1,     ///< surely none until t_safe, when two triangles are near and may go on to meet
  at_start = 2,  ///< the instances are in contact at the start, as the exact contact query says
};

/// The impact of a pair: when its two instances meet. If they do not meet in this step, the triangles and
/// faces are kNoIndex, the gap is infinite, and the points are 0.
struct Impact {
  double t_safe;  ///< seconds; the whole step where there is none, 0 where they are in contact at the start
  /// How far the two triangles are apart at t_safe: at most the tolerance and a resolution that grows with
  /// the turn, 2^-41 (1 + turn) size (docs/impact.md), unless steps ran out, which the counters tell. Other
  /// triangles of the pair may be nearer, but recede.
  double gap;
  double point_a[3], point_b[3];         ///< where these are nearest then, in the world
  std::uint32_t triangle_a, triangle_b;  ///< in leaf order
  std::uint32_t face_a, face_b;          ///< of the source files
  ImpactStatus status;
};

struct ImpactOptions {
  std::span<const RigidMotion> motion =
      {};               ///< of each instance, from where it stands; a removed one's is not looked at
  double duration = 0;  ///< of the step, in seconds
  /// Triangles that come this near stop a pair. It is a part of the diagonal of the smaller body's bounds.
  double tolerance = 1e-6;
};

/// Counts what a query did. The counters depend neither on the number of threads nor on the machine.
struct ImpactCounters {
  std::uint64_t object_pairs = 0;
  std::uint64_t at_start = 0, found = 0;  ///< of them
  std::uint64_t walks =
      0;  ///< of two trees: one for each half radian of a pair's turn, where balls come near
  std::uint64_t block_pairs = 0;
  std::uint64_t triangle_pairs = 0;  ///< whose boxes may meet
  std::uint64_t advanced = 0;        ///< of these, not told apart by their planes
  std::uint64_t steps = 0;           ///< of conservative advancement, of all of them
  std::uint64_t most_steps = 0;      ///< of one
  std::uint64_t unconverged = 0;     ///< those that stopped a pair for want of steps, above the tolerance

  friend bool operator==(const ImpactCounters&, const ImpactCounters&) = default;
};

/// Finds until when moving instances surely do not meet. The scene finds the object pairs whose boxes, swept
/// by the motions, meet. There is one row for each pair; an instance and itself do not move relative to each
/// other. find() takes about 100 KB of the calling thread's stack. Result of find(): as of ContactQuery;
/// kMotionMismatch where there are not as many motions as instances; kBadDuration or kBadTolerance where the
/// duration or the tolerance is negative or not finite; kOutOfRange where an instance, which where() of the
/// scene names, turns by more than kLargestTurn, or its centre, place or displacement are beyond
/// kLargestMovingCoordinate.
///
/// Two bodies at rest do not meet in the step, and a given pair that the scene would not find does not
/// either.
///
/// **Guarantee.** Unless a pair is in contact at the start, no triangles of its two instances meet at any
/// time in [0, t_safe]: neither those that move as RigidMotion defines, nor those that apply() makes of
/// pose_at(). Meshes need not be closed: a surface in another's inside is no contact. Proofs: pair_motion.h,
/// box_times.h and triangle_impact.h.
class ImpactQuery : public PairQuestion<ImpactQuery, Impact, ImpactCounters, ImpactOptions> {
 private:
  friend PairQuestion;
  struct State;
  Status answer(SceneState& scene, const std::span<const ObjectPair>* given, const ImpactOptions& options);

  Kept<State> state_;
};

}  // namespace tandem
