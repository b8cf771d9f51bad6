#include "working_tree.h"

#include <algorithm>

namespace tandem::build {
namespace {

// Returns all blocks of the topology, parents first.
std::vector<std::uint32_t> parents_first(const Topology& topology) {
  std::vector<std::uint32_t> order = {0};
  order.reserve(topology.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const TopologyBlock& block = topology[order[i]];
    if (!block.is_leaf_block)
      order.insert(order.end(), block.child.begin(), block.child.begin() + block.count);
  }
  return order;
}

template <typename Bounds>
class Cutter {
 public:
  Cutter(const WorkingTree<Bounds>& tree, std::uint32_t most_triangles)
      : tree_(tree), most_triangles_(most_triangles), triangles_(tree.size()) {
    count(0);
  }

  std::vector<Region> cut() {
    Region top;
    descend(0, 1, top);
    if (!top.blocks.empty()) regions_.push_back(std::move(top));
    return std::move(regions_);
  }

 private:
  std::uint32_t count(std::uint32_t block) {
    const typename WorkingTree<Bounds>::Block& self = tree_[block];
    std::uint32_t sum = self.is_leaf_block ? self.count : 0;
    for (int i = 0; i < self.count && !self.is_leaf_block; ++i) sum += count(self.child[i]);
    return triangles_[block] = sum;
  }

  void descend(std::uint32_t block, std::uint32_t depth, Region& top) {
    if (triangles_[block] <= most_triangles_ || tree_[block].is_leaf_block) {
      Region region;
      region.root = block;
      region.depth = depth;
      gather(block, region);
      for (const std::uint32_t leaf : leaves_) {
        for (int i = 0; i < tree_[leaf].count; ++i) region.children.push_back(tree_.child(leaf, i));
      }
      leaves_.clear();
      regions_.push_back(std::move(region));
      return;
    }
    top.blocks.push_back(block);
    for (int i = 0; i < tree_[block].count; ++i) {
      top.children.push_back(tree_.child(block, i));
      descend(tree_[block].child[i], depth + 1, top);
    }
  }

  void gather(std::uint32_t block, Region& region) {
    region.blocks.push_back(block);
    if (tree_[block].is_leaf_block) {
      leaves_.push_back(block);
      return;
    }
    for (int i = 0; i < tree_[block].count; ++i) {
      region.children.push_back(tree_.child(block, i));
      gather(tree_[block].child[i], region);
    }
  }

  const WorkingTree<Bounds>& tree_;
  std::uint32_t most_triangles_;
  std::vector<std::uint32_t> triangles_, leaves_;
  std::vector<Region> regions_;
};

}  // namespace

template <typename Bounds>
WorkingTree<Bounds>::WorkingTree(const Topology& topology, std::span<const Bounds> triangles)
    : blocks_(topology.size()), triangles_(triangles), triangle_parent_(triangles.size()) {
  const std::vector<std::uint32_t> order = parents_first(topology);
  for (auto b = order.rbegin(); b != order.rend(); ++b) {
    Block& block = blocks_[*b];
    block.child = topology[*b].child;
    block.count = topology[*b].count;
    block.is_leaf_block = topology[*b].is_leaf_block;
    adopt(*b);
    block.box = unite(block);
    block.height = height_of(block);
  }
}

template <typename Bounds>
Topology WorkingTree<Bounds>::topology() const {
  Topology topology(blocks_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    topology[b] = {blocks_[b].child, blocks_[b].count, blocks_[b].is_leaf_block};
  }
  return topology;
}

template <typename Bounds>
double WorkingTree<Bounds>::cost_change(std::uint32_t block, std::uint32_t out, const Bounds& in,
                                        std::uint32_t top) const {
  double change = 0;
  Bounds replaced = in;
  while (block != top) {
    const Block& self = blocks_[block];
    for (int i = 0; i < self.count; ++i) {
      if (self.child[i] != out) replaced.grow(bounds_of(child(block, i)));
    }
    if (replaced == self.box) break;  // nothing changes further up
    change += double{replaced.visit_cost()} - double{self.box.visit_cost()};
    out = block;
    block = self.parent;
  }
  return change;
}

template <typename Bounds>
void WorkingTree<Bounds>::apply(const Exchange& exchange, std::uint32_t top) {
  replace(exchange.first_parent, exchange.first.index, exchange.second);
  replace(exchange.second_parent, exchange.second.index, exchange.first);
  refit(exchange.first_parent, top);
  refit(exchange.second_parent, top);
}

// Puts `in` where `out` was; either may be nothing.
template <typename Bounds>
void WorkingTree<Bounds>::replace(std::uint32_t block, std::uint32_t out, Child in) {
  Block& self = blocks_[block];
  const auto begin = self.child.begin(), end = begin + self.count;
  const auto place = out == kNoIndex ? end : std::find(begin, end, out);
  if (in.index == kNoIndex) {
    *place = *(end - 1);
    --self.count;
    return;
  }
  *place = in.index;
  if (out == kNoIndex) ++self.count;
  (in.is_triangle ? triangle_parent_[in.index] : blocks_[in.index].parent) = block;
}

template <typename Bounds>
void WorkingTree<Bounds>::refit(std::uint32_t block, std::uint32_t top) {
  while (true) {
    Block& self = blocks_[block];
    const Bounds box = unite(self);
    const std::uint8_t height = height_of(self);
    if (box == self.box && height == self.height) return;
    self.box = box;
    self.height = height;
    if (block == top) return;
    block = self.parent;
  }
}

template <typename Bounds>
void WorkingTree<Bounds>::refresh_heights(std::uint32_t block) {
  for (; block != kNoIndex; block = blocks_[block].parent) blocks_[block].height = height_of(blocks_[block]);
}

template <typename Bounds>
void WorkingTree<Bounds>::restore(std::span<const std::uint32_t> blocks, std::span<const Block> saved) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    blocks_[blocks[i]] = saved[i];
    adopt(blocks[i]);
  }
}

template <typename Bounds>
Bounds WorkingTree<Bounds>::unite(const Block& block) const {
  Bounds box;
  for (int i = 0; i < block.count; ++i) box.grow(bounds_of({block.child[i], block.is_leaf_block}));
  return box;
}

template <typename Bounds>
std::uint8_t WorkingTree<Bounds>::height_of(const Block& block) const {
  std::uint8_t highest = 0;
  for (int i = 0; i < block.count && !block.is_leaf_block; ++i) {
    highest = std::max(highest, blocks_[block.child[i]].height);
  }
  return static_cast<std::uint8_t>(highest + 1);
}

template <typename Bounds>
void WorkingTree<Bounds>::adopt(std::uint32_t block) {
  const Block& self = blocks_[block];
  for (int i = 0; i < self.count; ++i) {
    (self.is_leaf_block ? triangle_parent_[self.child[i]] : blocks_[self.child[i]].parent) = block;
  }
}

template <typename Bounds>
std::vector<Region> cut_into_regions(const WorkingTree<Bounds>& tree, std::uint32_t most_triangles) {
  return Cutter(tree, most_triangles).cut();
}

template <typename Bounds>
double cost_of(const WorkingTree<Bounds>& tree, const Region& region) {
  double cost = 0;
  for (const std::uint32_t block : region.blocks) {
    if (block != region.root) cost += double{tree[block].box.visit_cost()};
  }
  return cost;
}

#define TANDEM_INSTANTIATE(Bounds)                                                          \
  template class WorkingTree<Bounds>;                                                       \
  template std::vector<Region> cut_into_regions(const WorkingTree<Bounds>&, std::uint32_t); \
  template double cost_of(const WorkingTree<Bounds>&, const Region&);
TANDEM_FOR_EACH_BOUNDS(TANDEM_INSTANTIATE)
#undef TANDEM_INSTANTIATE

}  // namespace tandem::build
