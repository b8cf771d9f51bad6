#pragma once
#include <compare>
#include <cstdint>
#include <span>

#include "tandem/kernels/detail/question.h"

namespace tandem {

/// Two bodies that touch in a configuration; a < b.
struct ConfigurationPair {
  std::uint32_t configuration;
  std::uint32_t a, b;

  friend auto operator<=>(const ConfigurationPair&, const ConfigurationPair&) = default;
};

struct ConfigurationOptions {
  std::span<const std::uint32_t> bodies;  ///< that move, each once; all others stand where they are
  /// The poses of `bodies` in each configuration, one configuration after the other.
  std::span<const Pose> poses;
  /// Clearance: bodies touch where their distance is at most this, decided exactly. 0: where they meet.
  double within = 0;
  bool all_pairs = false;  ///< all that touch in each configuration are found, not only the first
};

/// Counts what a query did. The counters depend neither on the number of threads nor on the machine.
struct ConfigurationCounters {
  std::uint64_t configurations = 0;
  std::uint64_t touching = 0;      ///< of these
  std::uint64_t object_pairs = 0;  ///< that were decided
  std::uint64_t block_pairs = 0;   ///< 16 box tests each

  friend bool operator==(const ConfigurationCounters&, const ConfigurationCounters&) = default;
};

/// Asks the same of many configurations of a scene: whether anything touches. The bodies that move get other
/// poses in each; what stands is prepared once, and the scene stays as it is. Pairs that the scene's filter
/// looks at count, but for pairs of bodies that both stand. Decides as ContactQuery in mode exact does, in
/// every configuration alike. All threads of the scene take part.
class ConfigurationQuery : public Answer<ConfigurationPair, ConfigurationCounters> {
 public:
  using Options = ConfigurationOptions;

  /// rows() are those of configurations in which something touches, ascending: one for each, or with
  /// all_pairs all. pairs() are none. find() takes about 100 KB of the stack of each thread. Result: kOk;
  /// kUnknownInstance, where where() of the scene is the place in `bodies` of one that does not exist or that
  /// stands there twice; kMotionMismatch where `poses` are not so many for each configuration; kBadReach (see
  /// ContactOptions::within); kPoseNotRigid or kOutOfRange, where where() is the first such pose;
  /// kTooManyPairs (2^32 - 1 configurations); kBadOption, where the scene is answered by a device;
  /// kCannotStartThread; or kOutOfMemory.
  Status find(Scene& scene, const ConfigurationOptions& options);

 private:
  struct State;
  Status answer(SceneState& scene, const ConfigurationOptions& options);

  Kept<State> state_;
};

}  // namespace tandem
