#include "topology.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "legal_splits.h"
#include "parallel/parallel.h"
#include "splitter.h"
#include "working_tree.h"

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

// Builds the tree with the fewest imaginary nodes.
template <typename Bounds>
class MinimalTree {
 public:
  explicit MinimalTree(std::span<const Bounds> bounds)
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
    const IsLegal is_legal = {[&](std::uint32_t left) { return legal.left_slots(left) != 0; }, legal.step()};
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

  TriangleSplitter<Bounds> splitter_;
  Topology topology_;
};

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

template <typename Bounds>
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
    const IsLegal any = {[](std::uint32_t) { return true; }};
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

  TriangleSplitter<Bounds> splitter_;
  std::vector<BinaryNode> nodes_;
};

template <typename Bounds>
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

  BinaryTree<Bounds> binary_;
  Topology topology_;
};

// Triangles of the smallest subtrees that are replaced: of more than a few blocks, or a free tree would have
// no freedom. The next larger ones have up to four times as many.
constexpr std::uint32_t kFewTriangles = 64;

template <typename Bounds>
using BuildTree = Topology (*)(const std::vector<Bounds>&);

struct Replacement {
  std::uint32_t root = 0;  // of the subtree that it replaces
  Topology topology;       // over the triangles of the whole mesh
  double saving = 0;
  std::int64_t more_blocks = 0;
  bool fits = false;  // below the blocks above it, within kMaxDepth

  double worth() const {
    return saving / static_cast<double>(std::max<std::int64_t>(std::abs(more_blocks), 1));
  }
};

// Another tree over what hangs below the region's root.
template <typename Bounds>
Replacement replacement_of(const WorkingTree<Bounds>& tree, const Region& region,
                           std::span<const Bounds> bounds, BuildTree<Bounds> build) {
  std::vector<std::uint32_t> triangles;
  std::vector<Bounds> their_bounds;
  for (const Child child : region.children) {
    if (!child.is_triangle) continue;
    triangles.push_back(child.index);
    their_bounds.push_back(bounds[child.index]);
  }
  Replacement replacement;
  replacement.root = region.root;
  replacement.topology = build(their_bounds);
  const WorkingTree<Bounds> other(replacement.topology, their_bounds);
  const Region whole = cut_into_regions(other, ~0u).front();
  replacement.saving = cost_of(tree, region) - cost_of(other, whole);
  replacement.more_blocks =
      static_cast<std::int64_t>(whole.blocks.size()) - static_cast<std::int64_t>(region.blocks.size());
  replacement.fits = region.depth + other[0].height - 1 <= kMaxDepth;
  for (TopologyBlock& block : replacement.topology) {
    for (int i = 0; i < block.count && block.is_leaf_block; ++i) block.child[i] = triangles[block.child[i]];
  }
  return replacement;
}

// Returns how many blocks a tree over n triangles has at most if no more than `share` of its nodes are
// imaginary: of B blocks' 4 B nodes, n + B - 1 are not.
std::int64_t blocks_within(std::size_t triangles, double share) {
  const auto n = static_cast<double>(triangles);
  return static_cast<std::int64_t>(3 - 4 * share > 0.1 ? (n - 1) / (3 - 4 * share) : 10 * n);
}

// Copies a tree, with other subtrees in the place of some.
class Splice {
 public:
  Splice(const Topology& tree, const std::vector<const Topology*>& instead)
      : tree_(tree), instead_(instead) {}

  Topology run() {
    copy(tree_, 0, true);
    return std::move(result_);
  }

 private:
  std::uint32_t copy(const Topology& from, std::uint32_t block, bool may_be_replaced) {
    if (may_be_replaced && instead_[block] != nullptr) return copy(*instead_[block], 0, false);
    const auto self = static_cast<std::uint32_t>(result_.size());
    result_.push_back(from[block]);
    for (int i = 0; i < from[block].count && !from[block].is_leaf_block; ++i) {
      const std::uint32_t child = copy(from, from[block].child[i], may_be_replaced);
      result_[self].child[i] = child;
    }
    return self;
  }

  const Topology& tree_;
  const std::vector<const Topology*>& instead_;
  Topology result_;
};

// The subtrees that are replaced; none lies in another.
template <typename Bounds>
class Replaced {
 public:
  explicit Replaced(const WorkingTree<Bounds>& tree)
      : tree_(tree), instead_(tree.size(), nullptr), holds_one_(tree.size(), 0) {}

  bool is_free(std::uint32_t block) const {
    if (holds_one_[block]) return false;
    for (; block != kNoIndex; block = tree_[block].parent) {
      if (instead_[block] != nullptr) return false;
    }
    return true;
  }

  void take(const Replacement& replacement) {
    instead_[replacement.root] = &replacement.topology;
    for (std::uint32_t b = replacement.root; b != kNoIndex; b = tree_[b].parent) holds_one_[b] = 1;
  }

  const std::vector<const Topology*>& instead() const { return instead_; }

 private:
  const WorkingTree<Bounds>& tree_;
  std::vector<const Topology*> instead_;
  std::vector<std::uint8_t> holds_one_;
};

// Other trees instead of the largest subtrees of at most `most_triangles` triangles.
template <typename Bounds>
void add_replacements(const WorkingTree<Bounds>& tree, std::span<const Bounds> bounds,
                      std::uint32_t most_triangles, BuildTree<Bounds> build, std::vector<Replacement>& all) {
  const std::vector<Region> regions = cut_into_regions(tree, most_triangles);
  const std::size_t count = regions.size() - (regions.size() > 1);  // without the blocks above them
  const std::size_t first = all.size();
  all.resize(first + count);
  parallel::for_each(
      count, [&](std::size_t i) { all[first + i] = replacement_of(tree, regions[i], bounds, build); });
}

// Keeps the replacements that fit, sorted by their worth, the most first.
void sort_by_worth(std::vector<Replacement>& replacements) {
  std::erase_if(replacements, [](const Replacement& replacement) { return !replacement.fits; });
  std::sort(replacements.begin(), replacements.end(), [](const Replacement& a, const Replacement& b) {
    return a.worth() != b.worth() ? a.worth() > b.worth() : a.root < b.root;
  });
}

// The free tree with as many subtrees minimal as it takes, where that costs least; nothing if that does not
// do.
template <typename Bounds>
std::optional<Topology> mostly_free(const std::vector<Bounds>& bounds, std::int64_t most_blocks) {
  const Topology free = build_free_tree(bounds);
  const WorkingTree<Bounds> tree(free, bounds);
  std::vector<Replacement> replacements;
  add_replacements<Bounds>(tree, bounds, kFewTriangles, build_minimal_tree, replacements);
  sort_by_worth(replacements);
  std::int64_t too_many = static_cast<std::int64_t>(free.size()) - most_blocks;
  Replaced<Bounds> replaced(tree);
  for (const Replacement& replacement : replacements) {
    if (too_many <= 0 && replacement.saving <= 0) break;
    too_many += replacement.more_blocks;
    replaced.take(replacement);
  }
  if (too_many > 0) return std::nullopt;
  return Splice(free, replaced.instead()).run();
}

// The minimal tree with subtrees of all sizes free where that saves most for a block.
template <typename Bounds>
Topology mostly_minimal(const std::vector<Bounds>& bounds, std::int64_t most_blocks) {
  const Topology minimal = build_minimal_tree(bounds);
  const WorkingTree<Bounds> tree(minimal, bounds);
  std::vector<Replacement> replacements;
  for (std::uint64_t size = kFewTriangles; size / 4 < bounds.size(); size *= 4) {
    const auto most_triangles = static_cast<std::uint32_t>(std::min<std::uint64_t>(size, ~0u));
    add_replacements<Bounds>(tree, bounds, most_triangles, build_free_tree, replacements);
  }
  sort_by_worth(replacements);
  std::int64_t budget = most_blocks - static_cast<std::int64_t>(minimal.size());
  Replaced<Bounds> replaced(tree);
  for (const Replacement& replacement : replacements) {
    if (replacement.saving <= 0 || replacement.more_blocks > budget || !replaced.is_free(replacement.root))
      continue;
    budget -= replacement.more_blocks;
    replaced.take(replacement);
  }
  return Splice(minimal, replaced.instead()).run();
}

}  // namespace

template <typename Bounds>
Topology build_minimal_tree(const std::vector<Bounds>& bounds) {
  const auto n = static_cast<std::uint32_t>(bounds.size());
  return MinimalTree<Bounds>(bounds).run(n);
}

template <typename Bounds>
Topology build_free_tree(const std::vector<Bounds>& bounds) {
  return Collapse<Bounds>(bounds).run();
}

template <typename Bounds>
Topology build_mixed_tree(const std::vector<Bounds>& bounds, double share) {
  const std::int64_t most_blocks = blocks_within(bounds.size(), share);
  if (std::optional<Topology> tree = mostly_free(bounds, most_blocks)) return std::move(*tree);
  return mostly_minimal(bounds, most_blocks);
}

#define TANDEM_INSTANTIATE(Bounds)                                  \
  template Topology build_minimal_tree(const std::vector<Bounds>&); \
  template Topology build_free_tree(const std::vector<Bounds>&);    \
  template Topology build_mixed_tree(const std::vector<Bounds>&, double);
TANDEM_FOR_EACH_BOUNDS(TANDEM_INSTANTIATE)
#undef TANDEM_INSTANTIATE

}  // namespace tandem::build
