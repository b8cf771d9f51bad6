#include <algorithm>

#include "parallel/parallel.h"
#include "splitter.h"
#include "topology.h"

namespace tandem::build {
namespace {

// A node of the binary tree, in depth-first order: the left child follows, the right one comes after the left
// subtree.
struct BinaryNode {
  std::uint32_t triangles;       // below this node
  std::uint32_t left_triangles;  // below the left child; 0 for a single triangle
  float visit_cost;
  // cost[k - 1]: least sum of costs of the nodes at and below this one if it may take k slots of a block.
  float cost[3];
  std::uint8_t left_slots[3];  // how many of k slots the left child takes; 0: this node takes one itself
  std::uint8_t block_split;    // the same for the four slots of the block below this node
};

class BinaryTree {
 public:
  explicit BinaryTree(std::span<const Bounds> bounds) : splitter_(bounds), nodes_(2 * bounds.size() - 1) {
    build(0, {0, static_cast<std::uint32_t>(bounds.size())}, 1);
    for (std::size_t node = nodes_.size(); node-- > 0;) collapse(static_cast<std::uint32_t>(node));
  }

  const BinaryNode& operator[](std::uint32_t node) const { return nodes_[node]; }
  std::uint32_t left(std::uint32_t node) const { return node + 1; }
  std::uint32_t right(std::uint32_t node) const { return node + 2 * nodes_[node].left_triangles; }
  std::span<const std::uint32_t> triangles(std::uint32_t first, std::uint32_t count) const {
    return splitter_.order({first, first + count});
  }

 private:
  Bounds build(std::uint32_t node, Range range, std::uint32_t depth) {
    BinaryNode& self = nodes_[node];
    self.triangles = range.size();
    if (range.size() == 1) {
      self.left_triangles = 0;
      const Bounds bounds = splitter_.bounds_of(splitter_.order(range)[0]);
      self.visit_cost = bounds.visit_cost();
      return bounds;
    }
    const Split split = choose(range, depth);
    splitter_.apply(range, split);
    self.left_triangles = split.left;
    const std::uint32_t middle = range.begin + split.left;
    Bounds bounds, other;
    const auto build_left = [&] { bounds = build(left(node), {range.begin, middle}, depth + 1); };
    const auto build_right = [&] { other = build(right(node), {middle, range.end}, depth + 1); };
    parallel::invoke_if(range.size() > kSerialSize, build_left, build_right);
    bounds.grow(other);
    self.visit_cost = bounds.visit_cost();
    return bounds;
  }

  Split choose(Range range, std::uint32_t depth) {
    const auto any = [](std::uint32_t) { return true; };
    Split best;
    if (!must_split_evenly(depth, range.size())) best = splitter_.best_split(range, any);
    return best.left != 0 ? best : splitter_.even_split(range, any);
  }

  // The cheapest way to share `slots`, 2 to 4, between the children.
  float cheapest_share(std::uint32_t node, std::uint32_t slots, std::uint8_t& left_slots) const {
    float best = std::numeric_limits<float>::infinity();
    for (std::uint32_t k = 1; k < slots; ++k) {
      const float cost = nodes_[left(node)].cost[k - 1] + nodes_[right(node)].cost[slots - k - 1];
      if (k == 1 || cost < best) {  // whatever the costs are, some share is chosen
        best = cost;
        left_slots = static_cast<std::uint8_t>(k);
      }
    }
    return best;
  }

  // Dynamic programming from the leaves up. A node that takes one slot costs what visits of its
  // child block do, and what lies below; up to four triangles make a leaf block, in which nothing
  // more is visited.
  void collapse(std::uint32_t node) {
    BinaryNode& self = nodes_[node];
    const bool single = self.left_triangles == 0;
    self.block_split = 0;
    const float below =
        self.triangles <= kNodesPerBlock ? 0 : cheapest_share(node, kNodesPerBlock, self.block_split);
    self.cost[0] = self.visit_cost + below;
    self.left_slots[0] = 0;
    for (std::uint32_t slots = 2; slots <= 3; ++slots) {
      float& cost = self.cost[slots - 1];
      std::uint8_t& left_slots = self.left_slots[slots - 1];
      cost = single ? self.cost[0] : cheapest_share(node, slots, left_slots);
      if (single || self.cost[0] <= cost) {
        cost = self.cost[0];
        left_slots = 0;
      }
    }
  }

  TriangleSplitter splitter_;
  std::vector<BinaryNode> nodes_;
};

class Collapse {
 public:
  explicit Collapse(std::span<const Bounds> bounds) : binary_(bounds) {}

  Topology run() {
    emit_block(0, 0);
    return std::move(topology_);
  }

 private:
  struct Child {
    std::uint32_t node, first;  // binary node, and where its triangles start in the order
  };
  struct Children {
    Child child[kNodesPerBlock];
    int count = 0;
  };

  void gather(std::uint32_t node, std::uint32_t first, std::uint32_t slots, std::uint32_t left_slots,
              Children& children) const {
    if (left_slots == 0) {
      children.child[children.count++] = {node, first};
      return;
    }
    const std::uint32_t left = binary_.left(node), right = binary_.right(node),
                        right_slots = slots - left_slots;
    gather(left, first, left_slots, binary_[left].left_slots[left_slots - 1], children);
    gather(right, first + binary_[node].left_triangles, right_slots,
           binary_[right].left_slots[right_slots - 1], children);
  }

  std::uint32_t emit_block(std::uint32_t node, std::uint32_t first) {
    const auto block = static_cast<std::uint32_t>(topology_.size());
    TopologyBlock self;
    const BinaryNode& binary = binary_[node];
    topology_.emplace_back();
    if (binary.triangles <= kNodesPerBlock) {
      const auto triangles = binary_.triangles(first, binary.triangles);
      std::copy(triangles.begin(), triangles.end(), self.child.begin());
      self.count = static_cast<std::uint8_t>(binary.triangles);
      self.is_leaf_block = true;
    } else {
      Children children;
      gather(node, first, kNodesPerBlock, binary.block_split, children);
      self.count = static_cast<std::uint8_t>(children.count);
      for (int i = 0; i < children.count; ++i) {
        self.child[i] = emit_block(children.child[i].node, children.child[i].first);
      }
    }
    topology_[block] = self;
    return block;
  }

  BinaryTree binary_;
  Topology topology_;
};

}  // namespace

Topology build_free_tree(std::span<const Bounds> bounds) {
  return Collapse(bounds).run();
}

}  // namespace tandem::build
