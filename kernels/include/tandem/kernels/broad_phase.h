#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/formats/status.h"
#include "tandem/kernels/detail/box_tree.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/object_pair.h"
#include "tandem/kernels/pair_filter.h"
#include "tandem/kernels/world_box.h"

namespace tandem {

class WorkerThreads;

/// Finds all pairs of world boxes that meet, or those of them that a filter looks at. Keeps its memory from
/// call to call: in a steady state nothing is allocated. Throws nothing.
///
/// Boxes are split into four again and again, at medians along the longest extent, which makes a complete
/// tree of groups of four; it is traversed in tandem with itself. O(n log n) for boxes of bounded overlap,
/// whatever their distribution: one that is far from all others costs no more than the rest. All in float64,
/// so that the tree's answer is exact. Where the filter tells instances apart, each group knows the groups,
/// masks, motions and worlds that are in it, so a pair of groups of which the filter looks at no pair ends
/// the walk, and boxes in one place are split by these. Boxes of several worlds are split by world first.
/// Boxes of fixed instances may be kept in a tree of their own: then a call makes one of the others, and
/// traverses that in tandem with itself and with the kept one.
class BroadPhase {
 public:
  /// Result: kOk; kOutOfMemory; kOutOfRange where a coordinate is NaN or beyond kLargestWorldCoordinate;
  /// kTooManyInstances, kTooManyPairs: 2^32 - 1 boxes or pairs, or more. The pairs are those whose boxes
  /// meet, touching included, and that the filter looks at, no more and no fewer, sorted by a, then b. One
  /// thread. kUnknownInstance where the filter excludes a pair of boxes that there are not; kKeptMismatch
  /// where fixed boxes are kept of another number of boxes.
  Status find_pairs(std::span<const WorldBox> boxes, const PairFilter& filter = {});

  /// Finds the pairs with the threads of a query, for `workers` workers. Neither the pairs nor group_pairs()
  /// depend on their number. self_pairs: each box with itself is a pair too, where the filter looks at it.
  Status find_pairs(std::span<const WorldBox> boxes, const PairFilter& filter, bool self_pairs,
                    WorkerThreads& threads, std::uint32_t workers);

  /// Keeps the boxes whose motion is fixed for the calls to come, which must be of as many boxes: they find
  /// no pair of two kept ones, and look at no kept box again; it is where it was, and the filter still says
  /// that it is fixed, and in the same world. A later call replaces what is kept. motion, world: of each box;
  /// world is null where the filter has none. Result: as of find_pairs(); kKeptMismatch where the sizes
  /// differ. After an error nothing is kept.
  Status keep_fixed(std::span<const WorldBox> boxes, std::span<const Motion> motion,
                    const std::uint32_t* world = nullptr);
  Status keep_fixed(std::span<const WorldBox> boxes, std::span<const Motion> motion,
                    const std::uint32_t* world, WorkerThreads& threads, std::uint32_t workers);

  void forget_fixed();

  /// Makes a tree of all boxes, whose kinds are those of the filter. It has no groups where there are no
  /// boxes. Result: as of find_pairs(); after an error the tree is of no use.
  static Status make_tree(std::span<const WorldBox> boxes, const PairFilter& filter, WorkerThreads& threads,
                          std::uint32_t workers, BoxTree& tree);

  /// Returns the number of boxes whose fixed ones are kept, 0 where none are.
  std::size_t kept_of() const { return kept_of_; }

  /// The boxes that a call looks at: all but those that are kept, ascending. count: of all boxes. Condition:
  /// none are kept, or of so many.
  std::size_t free_count(std::size_t count) const { return kept_of_ == 0 ? count : free_.size(); }
  std::uint32_t free_box(std::size_t i) const {
    return kept_of_ == 0 ? static_cast<std::uint32_t>(i) : free_[i];
  }

  /// The tree of the kept boxes. Condition: some are kept.
  const BoxTree& kept() const { return kept_; }

  /// The pairs of the last call that returned kOk; valid until the next call.
  std::span<const ObjectPair> pairs() const { return pairs_.view(); }

  /// Returns how many pairs of groups the last call looked at: its work, independent of the machine.
  std::uint64_t group_pairs() const { return group_pairs_; }

 private:
  static constexpr int kGroup = BoxTree::kGroup;

  using Tree = BoxTree;
  using Item = BoxTree::Item;
  using Group = BoxTree::Group;
  using Kind = BoxTree::Kind;
  using Kinds = BoxTree::Kinds;

  /// Items that make `units` runs of `unit` items, the last of which may be shorter. A unit is a power of
  /// four.
  struct Range {
    std::size_t begin, count, unit, units;
  };

  /// The trees that are traversed in tandem: the same one twice, or two.
  struct TreePair {
    const Tree &a, &b;

    bool same() const { return &a == &b; }
  };

  /// Two groups, of one level; where one tree has fewer levels, its root stands for itself on those above.
  /// Within one tree a <= b.
  struct GroupPair {
    std::uint32_t a, b;  // within their level
    int level;
  };

  /// The pairs that a worker found.
  struct alignas(64) Finder : Allocated {
    Buffer<ObjectPair> pairs;
    std::uint64_t group_pairs = 0;
    bool enough_memory = true;
  };

  struct Team {
    WorkerThreads& threads;
    std::uint32_t workers;
  };

  bool provide_finders(std::uint32_t workers);
  static std::uint32_t meeting(const Group& a, const Group& b);
  static std::uint32_t meeting(const TreePair& trees, const GroupPair& pair);
  static std::uint32_t may_look(const TreePair& trees, const GroupPair& pair);
  static bool take(std::span<const WorldBox> boxes, const std::uint32_t* world, const std::uint32_t* numbers,
                   Tree& tree, Team team);
  static bool halve(Item* all, const PairFilter& filter, Range& range, Range& right);
  static void split(Item* all, const PairFilter& filter, Range range);
  static void split(Item* all, const PairFilter& filter, Range range, Team team);
  static void build(std::span<const WorldBox> boxes, const PairFilter& filter, Tree& tree, Team team);
  static void build_level(int level, std::size_t below, std::span<const WorldBox> boxes, Tree& tree,
                          Team team);
  static void build_kinds(int level, std::size_t below, const PairFilter& filter, Tree& tree, Team team);
  static void collect(const TreePair& trees, GroupPair from, const PairFilter& filter, std::uint32_t owners,
                      Finder& finder);
  bool collect(const TreePair& trees, const PairFilter& filter, Team team);
  bool collect_selves(const PairFilter& filter);
  Status sort_pairs(std::size_t boxes, Team team);

  Tree tree_, kept_;
  std::size_t kept_of_ = 0;
  Buffer<std::uint32_t> free_, fixed_;  // numbers of boxes that are not kept, and that are
  std::uint64_t group_pairs_ = 0;
  Buffer<GroupPair> starts_;  // of the workers' walks
  std::unique_ptr<Finder[]> finders_;
  std::uint32_t finder_count_ = 0;
  Buffer<ObjectPair> pairs_;
  Buffer<std::uint32_t> first_;  // where the pairs of each run of numbers begin
};

}  // namespace tandem
