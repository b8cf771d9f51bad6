#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>

namespace tandem::build {

/// Says how many imaginary nodes a tree may have.
struct Imaginary {
  /// The share of all nodes that may be imaginary beyond the minimum. 0: the proven minimum,
  /// minimal_imaginary_nodes(). 1: wherever the cheapest collapse of a free binary tree puts them, about a
  /// fifth. Between: where a given number of them saves most.
  double share = 0;

  static const Imaginary minimal, free;
  bool operator==(const Imaginary&) const = default;
};

inline constexpr Imaginary Imaginary::minimal{0}, Imaginary::free{1};

/// Says how much time goes into making a tree cheap to query.
enum class Effort : std::uint8_t {
  fast,      ///< greedy splits only
  standard,  ///< then one pass of exchanges: at most twice as long again
  best,      ///< then simulated annealing: minutes for 10^5 triangles
};

/// The most samples of an animation that a tree is made for.
inline constexpr int kMostTreeSamples = 64;

/// Says what a .bvh file is to hold beside its triangles, and how long, by how many threads, a good tree is
/// looked for.
struct BuildOptions {
  Imaginary imaginary = Imaginary::minimal;
  Effort effort = Effort::standard;
  bool gpu_blocks = true;  ///< the file gets oriented blocks
  bool topology = true;    ///< the file gets topology
  bool refit = true;       ///< where it gets topology, also what refitting the tree to a bent mesh needs
  unsigned threads = 0;    ///< that build, at most; 0: as many as the process may use
};

/// Lets somebody look on while a file is built, and end the optimisation.
class OptimisationWatch {
 public:
  /// The builder calls this now and then, by one thread at a time, with the share of the whole time that is
  /// done, roughly; it never falls. What it throws ends the build.
  std::function<void(double share)> progress = [](double) {};
  /// Once this is set, optimisation ends within a second or so, with the best tree so far.
  std::atomic<bool> stop = false;

  /// The optimiser says how many units of work there are, and that some more are done.
  void expect(std::uint64_t units) { expected_ = units; }
  void count(std::uint64_t units);
  /// The builder calls this after a step, with the share of the part under way that is done then.
  void reach(double share);
  /// The units of the optimiser lie between these shares of the part under way.
  void optimise_between(double begin, double end) { optimised_ = {begin, end}; }
  /// The steps that come next are this part of the whole.
  void begin_part(double begin, double end) { part_ = {begin, end}; }

 private:
  struct Span {
    double begin, end;
    double at(double share) const { return begin + (end - begin) * share; }
  };
  void tell(double share_of_part);

  std::uint64_t expected_ = 1;
  std::mutex mutex_;
  std::uint64_t done_ = 0;
  Span part_ = {0, 1}, optimised_ = {0, 1};
  double told_ = 0;
};

}  // namespace tandem::build
