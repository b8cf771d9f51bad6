#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/formats/status.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/world_box.h"

namespace tandem {

class WorkerThreads;

/// Two instances whose world boxes meet; a < b.
struct ObjectPair {
  std::uint32_t a, b;
};

/// Finds all pairs of world boxes that meet. Keeps its memory from call to call: in a steady state nothing is
/// allocated. Throws nothing.
///
/// Boxes are split into four again and again, at medians along the longest extent, which makes a complete
/// tree of groups of four; it is traversed in tandem with itself. O(n log n) for boxes of bounded overlap,
/// whatever their distribution: one that is far from all others costs no more than the rest. All in float64,
/// so that the tree's answer is exact.
class BroadPhase {
 public:
  /// Result: kOk; kOutOfMemory; kOutOfRange where a coordinate is NaN or beyond kLargestWorldCoordinate;
  /// kTooManyInstances, kTooManyPairs: 2^32 - 1 boxes or pairs, or more. The pairs are those whose boxes
  /// meet, touching included, no more and no fewer, sorted by a, then b. One thread.
  Status find_pairs(std::span<const WorldBox> boxes);

  /// The same with the threads of a query, which are there for so many workers; neither the pairs nor
  /// group_pairs() depend on their number. self_pairs: each box with itself is a pair too.
  Status find_pairs(std::span<const WorldBox> boxes, bool self_pairs, WorkerThreads& threads,
                    std::uint32_t workers);

  /// The pairs of the last call that returned kOk; valid until the next call.
  std::span<const ObjectPair> pairs() const { return pairs_.view(); }

  /// How many pairs of groups the last call looked at: its work, independent of the machine.
  std::uint64_t group_pairs() const { return group_pairs_; }

 private:
  static constexpr int kGroup = 4;

  /// A box on its way to its place in the tree.
  struct Item {
    double center[3];
    std::uint32_t box;
  };

  /// Four boxes, or the boxes of four groups; where there are fewer, the others are empty, [inf, -inf].
  struct alignas(64) Group {
    double lo[3][kGroup], hi[3][kGroup];
  };

  /// Items that make `units` runs of `unit` items, the last of which may be shorter. A unit is a power of
  /// four.
  struct Range {
    std::size_t begin, count, unit, units;
  };

  /// Two groups of one level; a <= b.
  struct GroupPair {
    std::uint32_t a, b;  // within their level
    int level;
  };

  /// What a worker found.
  struct alignas(64) Finder {
    Buffer<ObjectPair> pairs;
    std::uint64_t group_pairs = 0;
    bool enough_memory = true;
  };

  struct Team {
    WorkerThreads& threads;
    std::uint32_t workers;
  };

  static std::uint32_t meeting(const Group& a, const Group& b);
  bool reserve(std::size_t boxes, std::uint32_t workers);
  bool take(std::span<const WorldBox> boxes, Team team);
  bool halve(Range& range, Range& right);
  void split(Range range);
  void split(Range all, Team team);
  void build(std::span<const WorldBox> boxes, Team team);
  void build_level(int level, std::size_t below, std::span<const WorldBox> boxes, Team team);
  std::uint32_t meeting(const GroupPair& pair) const;
  void collect(GroupPair from, std::uint32_t owners, Finder& finder) const;
  bool collect(Team team);
  Status sort_pairs(std::size_t boxes, bool self_pairs, Team team);

  Buffer<Item> items_;                // in the order of the tree
  Buffer<Group> groups_;              // level by level from the leaves
  std::size_t level_begin_[17] = {};  // where each level of groups begins
  int levels_ = 0;
  std::uint64_t group_pairs_ = 0;
  Buffer<GroupPair> starts_;  // of the workers' walks
  std::unique_ptr<Finder[]> finders_;
  std::uint32_t finder_count_ = 0;
  Buffer<ObjectPair> pairs_;
  Buffer<std::uint32_t> first_;  // of each box, where its pairs begin
};

}  // namespace tandem
