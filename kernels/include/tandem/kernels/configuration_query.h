#pragma once
#include <compare>
#include <cstdint>
#include <span>

#include "tandem/kernels/detail/interval.h"
#include "tandem/kernels/detail/question.h"

namespace tandem {

/// Two bodies of a configuration that touch, or are nearest; a < b.
struct ConfigurationPair {
  std::uint64_t configuration;
  std::uint32_t a, b;
  double lower, upper;  ///< lower <= distance <= upper, see ConfigurationOptions::find

  friend auto operator<=>(const ConfigurationPair&, const ConfigurationPair&) = default;
};

/// Says which pairs of a configuration are found.
enum class ConfigurationPairs : std::uint32_t {
  first,    ///< one that touches, if any does; its distance is known to be at most `within`
  all,      ///< all that touch; as above
  nearest,  ///< that whose distance has the least upper bound, unless all are surely farther than `within`;
            ///< lower <= the least distance of all pairs <= upper, both 0 exactly where some meet
};

struct ConfigurationOptions {
  std::span<const std::uint32_t> bodies;  ///< that move, each once; all others stand where they are
  /// The poses of `bodies` in each configuration, one configuration after the other.
  std::span<const Pose> poses;
  /// Clearance: bodies touch where their distance is at most this, decided exactly. 0: where they meet. For
  /// `nearest` how far is looked, which may be infinite.
  double within = 0;
  ConfigurationPairs find = ConfigurationPairs::first;
  DistanceTolerance tolerance = {};  ///< of `nearest`
};

/// Counts what a query did. The counters depend neither on the number of threads nor on the machine.
struct ConfigurationCounters {
  std::uint64_t configurations = 0;
  std::uint64_t touching = 0;      ///< of these; for `nearest`, those with a pair that meets
  std::uint64_t object_pairs = 0;  ///< that were decided
  std::uint64_t block_pairs = 0;   ///< 16 box tests each; 0 where a device answered

  friend bool operator==(const ConfigurationCounters&, const ConfigurationCounters&) = default;
};

/// Asks the same of many configurations of a scene: whether anything touches, or how near it comes. The
/// bodies that move get other poses in each; what stands is prepared once, and the scene stays as it is.
/// Pairs that the scene's filter looks at count, but for pairs of bodies that both stand. Decides as
/// ContactQuery in mode exact does, and bounds distances as DistanceQuery, in every configuration alike. All
/// threads of the scene take part. A device answers many configurations at a time, each as a world of its
/// own.
class ConfigurationQuery : public Answer<ConfigurationPair, ConfigurationCounters> {
 public:
  using Options = ConfigurationOptions;

  /// rows() ascend by configuration, a and b: one for each configuration at most, or `all`. pairs() are none.
  /// find() takes about 100 KB of the stack of each thread. Result: kOk; kUnknownInstance, where where() of
  /// the scene is the place in `bodies` of one that does not exist or that stands there twice;
  /// kMotionMismatch where `poses` are not so many for each configuration; kBadReach (see
  /// ContactOptions::within; for `nearest` as DistanceOptions::reach); kBadTolerance; kPoseNotRigid or
  /// kOutOfRange, where where() is the first such pose; kCannotStartThread; kOutOfMemory; or as of
  /// ContactQuery and DistanceQuery.
  Status find(Scene& scene, const ConfigurationOptions& options);

 private:
  struct State;
  Status answer(SceneState& scene, const ConfigurationOptions& options);

  Kept<State> state_;
};

}  // namespace tandem
