#include <algorithm>

#include "legal_splits.h"
#include "parallel/parallel.h"
#include "splitter.h"
#include "topology.h"

namespace tandem::build {
namespace {

// The groups that become the nodes of one block.
struct Groups {
  Range range[kNodesPerBlock];
  int count = 0;

  void append(const Groups& other) {
    for (int i = 0; i < other.count; ++i) range[count++] = other.range[i];
  }
};

class Builder {
 public:
  explicit Builder(std::span<const Bounds> bounds)
      : splitter_(bounds), topology_(blocks_for(static_cast<std::uint32_t>(bounds.size()))) {}

  Topology run(std::uint32_t triangles) {
    build_block({0, triangles}, 0, 1);
    return std::move(topology_);
  }

 private:
  // Builds the tree over the group into blocks [block, block + blocks_for(n)).
  void build_block(Range range, std::uint32_t block, std::uint32_t depth) {
    TopologyBlock& self = topology_[block];
    if (range.size() <= kNodesPerBlock) {
      const auto triangles = splitter_.order(range);
      std::copy(triangles.begin(), triangles.end(), self.child.begin());
      self.count = static_cast<std::uint8_t>(range.size());
      self.is_leaf_block = true;
      return;
    }
    const Groups groups = split(range, kNodesPerBlock, depth);
    self.count = static_cast<std::uint8_t>(groups.count);
    std::uint32_t next = block + 1;
    for (int i = 0; i < groups.count; ++i) {
      self.child[i] = next;
      next += blocks_for(groups.range[i].size());
    }
    build_children(groups, self.child.data(), 0, groups.count, depth);
  }

  void build_children(const Groups& groups, const std::uint32_t* child, int first, int last,
                      std::uint32_t depth) {
    if (last - first == 1) return build_block(groups.range[first], child[first], depth + 1);
    const int middle = (first + last) / 2;
    parallel::invoke_if(
        groups.range[last - 1].end - groups.range[first].begin > kSerialSize,
        [&] { build_children(groups, child, first, middle, depth); },
        [&] { build_children(groups, child, middle, last, depth); });
  }

  // Splits the group into at most `slots` groups, as few as its leaf blocks.
  Groups split(Range range, std::uint32_t slots, std::uint32_t depth) {
    if (slots == 1 || range.size() <= kNodesPerBlock) return {{range}, 1};
    const LegalSplits legal(range.size(), slots);
    const auto is_legal = [&](std::uint32_t left) { return legal.left_slots(left) != 0; };
    Split best;
    if (!must_split_evenly(depth, range.size())) best = splitter_.best_split(range, is_legal);
    if (best.left == 0) best = splitter_.even_split(range, is_legal);
    splitter_.apply(range, best);

    const std::uint32_t left_slots = legal.left_slots(best.left), middle = range.begin + best.left;
    Groups left, right;
    parallel::invoke_if(
        range.size() > kSerialSize,
        [&] {
          left = split({range.begin, middle}, left_slots, depth);
        },
        [&] {
          right = split({middle, range.end}, slots - left_slots, depth);
        });
    left.append(right);
    return left;
  }

  TriangleSplitter splitter_;
  Topology topology_;
};

}  // namespace

Topology build_minimal_tree(std::span<const Bounds> bounds) {
  const auto n = static_cast<std::uint32_t>(bounds.size());
  return Builder(bounds).run(n);
}

}  // namespace tandem::build
