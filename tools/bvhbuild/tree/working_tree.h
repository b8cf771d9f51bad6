#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bounds.h"
#include "topology.h"

namespace tandem::build {

/// A child of a block: another block, or a triangle of a leaf block.
struct Child {
  std::uint32_t index = kNoIndex;
  bool is_triangle = false;
};

/// Two children of the same kind that change places. `second` may be an empty place of `second_parent`
/// (kNoIndex): then the first one only moves.
struct Exchange {
  Child first, second;
  std::uint32_t first_parent = 0, second_parent = 0;
};

/// A tree whose children change places. Bounds: Bounds or SampledBounds, here and below. Whatever is
/// exchanged, the number of blocks, and with it that of imaginary nodes, stays. Disjoint subtrees may be
/// worked on by different threads.
template <typename Bounds>
class WorkingTree {
 public:
  struct alignas(64) Block {
    Bounds box;
    std::array<std::uint32_t, kNodesPerBlock> child{};
    std::uint32_t parent = kNoIndex;
    std::uint8_t count = 0;
    bool is_leaf_block = false;
    std::uint8_t height = 1;  // blocks from this one to the deepest leaf block below it, both counted
  };

  /// `triangles`: normalized_bounds(), which must outlive the tree.
  WorkingTree(const Topology& topology, std::span<const Bounds> triangles);

  Topology topology() const;
  const Block& operator[](std::uint32_t block) const { return blocks_[block]; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(blocks_.size()); }

  Child child(std::uint32_t block, int place) const {
    return {blocks_[block].child[place], blocks_[block].is_leaf_block};
  }
  const Bounds& bounds_of(Child child) const {
    return child.is_triangle ? triangles_[child.index] : blocks_[child.index].box;
  }
  std::uint32_t parent_of(Child child) const {
    return child.is_triangle ? triangle_parent_[child.index] : blocks_[child.index].parent;
  }

  /// Returns how much more the blocks from `block` up to, but without, `top` would cost if its child `out`
  /// were replaced by something of bounds `in`. `out` may be kNoIndex, and `in` empty.
  double cost_change(std::uint32_t block, std::uint32_t out, const Bounds& in, std::uint32_t top) const;

  /// Makes the change; boxes and heights follow, up to the block `top`, below which both parents lie.
  void apply(const Exchange& exchange, std::uint32_t top);

  /// Recomputes the heights from `block` up to the root.
  void refresh_heights(std::uint32_t block);

  /// Brings blocks back as they were, with all that hung on them. Condition: `saved` are all blocks of a
  /// subtree.
  void restore(std::span<const std::uint32_t> blocks, std::span<const Block> saved);

 private:
  Bounds unite(const Block& block) const;
  void replace(std::uint32_t block, std::uint32_t out, Child in);
  void refit(std::uint32_t block, std::uint32_t top);
  std::uint8_t height_of(const Block& block) const;
  void adopt(std::uint32_t block);

  std::vector<Block> blocks_;
  std::span<const Bounds> triangles_;
  std::vector<std::uint32_t> triangle_parent_;
};

/// A subtree that one thread improves by itself.
struct Region {
  std::uint32_t root = 0;
  std::uint32_t depth = 1;            ///< of the root; 1 for that of the tree
  std::vector<Child> children;        ///< what may change places: all below the root, blocks first
  std::vector<std::uint32_t> blocks;  ///< all of them, the root first
};

/// Cuts a tree into subtrees of at most `most_triangles` triangles, as large as may be, which depends on the
/// tree alone. The blocks above them, with the subtrees' roots as their children, are the last region.
template <typename Bounds>
std::vector<Region> cut_into_regions(const WorkingTree<Bounds>& tree, std::uint32_t most_triangles);

/// The sum of visit_cost() of the region's blocks below its root.
template <typename Bounds>
double cost_of(const WorkingTree<Bounds>& tree, const Region& region);

/// Finds exchanges that make a subtree cheaper. Each thread has its own; they may work on different regions
/// of one tree.
template <typename Bounds>
class ExchangeSearch {
 public:
  explicit ExchangeSearch(WorkingTree<Bounds>& tree) : tree_(tree), marks_(tree.size()) {}

  /// Makes for each child in turn the exchange with another one below the region's root that saves most; ends
  /// early where searches take far longer than they do on ordinary meshes. Result: how many were made.
  std::uint32_t pass(const Region& region);

  /// Returns how the cost of the tree changes by an exchange; infinity where it is not possible: both have
  /// the same parent, one lies below the other, the tree would become too deep, or a block empty.
  double cost_change(const Exchange& exchange, const Region& region);

 private:
  struct Mark {
    std::uint32_t stamp = 0, depth = 0;
  };
  struct Waiting {
    std::uint32_t block;
    double growth;  // what it costs that block and those above it to take the child in
  };

  bool improve(Child child, const Region& region);
  void try_places_of(std::uint32_t block, Exchange exchange, double gain, Exchange& best,
                     double& least) const;
  void descend(const Waiting& at, Child child, double gain);
  void mark_ancestors(std::uint32_t block, const Region& region);
  bool is_marked(std::uint32_t block) const { return marks_[block].stamp == stamp_; }
  double change_by(const Exchange& exchange, double limit) const;

  WorkingTree<Bounds>& tree_;
  std::vector<Mark> marks_;  // of the first parent and the blocks above it
  std::uint32_t stamp_ = 0;
  std::vector<Waiting> waiting_;
  std::uint64_t searched_ = 0;  // blocks, by the present pass
};

}  // namespace tandem::build
