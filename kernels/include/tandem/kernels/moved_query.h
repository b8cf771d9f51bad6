#pragma once
#include <cstdint>
#include <span>

#include "tandem/kernels/detail/question.h"

namespace tandem {

/// A pair, and its bodies as they stood when it was last among those that have moved.
struct PosedBodies {
  ObjectPair pair;
  Instance a, b;
};

struct MovedOptions {
  /// A pair may be kept as it was found while no point of the smaller body, seen from the larger one, has
  /// moved by more than this. 0: no pair is kept; infinite: all that were asked about. Not negative, else
  /// kBadTolerance.
  double tolerance = 0;
  std::span<const double> tolerance_of_pair = {};  ///< one for each pair instead, or none, else kBadOption
};

struct MovedCounters {
  std::uint64_t object_pairs = 0, kept = 0;

  friend bool operator==(const MovedCounters&, const MovedCounters&) = default;
};

/// Finds the object pairs that have moved, so that the next question need only be about these. Rows are the
/// pairs that are to be asked about, in the order of pairs(): those that have moved by more than the
/// tolerance since they last were rows, that were not among the pairs of the call before, or one of whose
/// bodies is of another asset, or of one that has been deformed since. The others are kept: what was found of
/// them is that of the poses where they were rows. ManifoldQuery keeps their manifolds.
///
/// The motion is bounded from above (kernels/geometry/pair_motion.h), rounding included, so a pair may be a
/// row although it has moved by a little less. Result of find(): kOk; kBadTolerance, where where() of the
/// scene is the pair that has it; kBadOption; or as of ContactQuery. After an error, and of other assets,
/// nothing is kept.
class MovedQuery : public PairQuestion<MovedQuery, ObjectPair, MovedCounters, MovedOptions> {
 public:
  /// Returns for each of pairs() its row among the pairs of the call before, if it is kept, or kNoIndex.
  std::span<const std::uint32_t> kept_rows() const { return kept_rows_.view(); }

  /// Returns each of pairs() as it stood when it was last a row.
  std::span<const PosedBodies> posed() const { return posed_.view(); }

  /// Lets the next call of find() go on from what posed() was, of this scene and its assets. Result: kOk;
  /// kUnknownAsset, where where() is the entry; or kOutOfMemory.
  Status resume(Scene& scene, std::span<const PosedBodies> posed);

  /// The next call keeps nothing: to be called where the questions about the rows failed.
  void forget_poses();

  /// Return numbers of this call and of the one before, which no other call of this process has.
  std::uint64_t call() const { return call_; }
  std::uint64_t call_before() const { return call_before_; }

  /// Returns whether the second of two assets is the larger one, by the diagonal of its bounds.
  bool second_is_larger(std::uint32_t a, std::uint32_t b) const;

  /// Returns whether a scene stands as it did in this call.
  bool is_of(const SceneState& scene) const;

 private:
  friend PairQuestion;
  struct State;
  Status answer(SceneState& scene, const std::span<const ObjectPair>* given, const MovedOptions& options);
  Status check(SceneState& scene, const MovedOptions& options) const;
  Status decide(SceneState& scene, State& state, const MovedOptions& options);

  Kept<State> state_;
  Buffer<std::uint32_t> kept_rows_;
  Buffer<PosedBodies> posed_;
  std::uint64_t call_ = 0, call_before_ = 0;
};

}  // namespace tandem
