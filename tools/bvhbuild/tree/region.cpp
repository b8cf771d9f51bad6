#include "region.h"

namespace tandem::build {
namespace {

class Cutter {
 public:
  Cutter(const WorkingTree& tree, std::uint32_t most_triangles)
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
    const WorkingTree::Block& self = tree_[block];
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

  const WorkingTree& tree_;
  std::uint32_t most_triangles_;
  std::vector<std::uint32_t> triangles_, leaves_;
  std::vector<Region> regions_;
};

}  // namespace

std::vector<Region> cut_into_regions(const WorkingTree& tree, std::uint32_t most_triangles) {
  return Cutter(tree, most_triangles).cut();
}

}  // namespace tandem::build
