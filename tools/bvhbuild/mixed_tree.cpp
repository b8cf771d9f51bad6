#include "mixed_tree.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "free_tree.h"
#include "minimal_tree.h"
#include "region.h"
#include "working_tree.h"

namespace tandem::build {
namespace {

// Triangles of a subtree that is replaced: few, so that there is much to choose from; more than a few blocks,
// or a free tree would have no freedom.
constexpr std::uint32_t kMostTriangles = 64;

struct Replacement {
  std::uint32_t root = 0;  // of the subtree that it replaces
  Topology topology;       // over the triangles of the whole mesh
  double saving = 0;
  std::int64_t more_blocks = 0;

  double worth() const { return saving / static_cast<double>(std::max<std::int64_t>(more_blocks, 1)); }
};

double cost_of(const WorkingTree& tree, std::uint32_t root, std::span<const std::uint32_t> blocks) {
  double cost = 0;
  for (const std::uint32_t block : blocks) cost += block == root ? 0.0 : tree[block].box.visit_cost();
  return cost;
}

// The free tree over what hangs below the region's root.
Replacement free_instead_of(const WorkingTree& tree, const Region& region, std::span<const Bounds> bounds) {
  std::vector<std::uint32_t> triangles;
  std::vector<Bounds> their_bounds;
  for (const Child child : region.children) {
    if (!child.is_triangle) continue;
    triangles.push_back(child.index);
    their_bounds.push_back(bounds[child.index]);
  }
  Replacement replacement;
  replacement.root = region.root;
  replacement.topology = build_free_tree(their_bounds);
  const WorkingTree free(replacement.topology, their_bounds);
  const Region whole = cut_into_regions(free, ~0u).front();
  replacement.saving = cost_of(tree, region.root, region.blocks) - cost_of(free, 0, whole.blocks);
  replacement.more_blocks =
      static_cast<std::int64_t>(whole.blocks.size()) - static_cast<std::int64_t>(region.blocks.size());
  for (TopologyBlock& block : replacement.topology) {
    for (int i = 0; i < block.count && block.is_leaf_block; ++i) block.child[i] = triangles[block.child[i]];
  }
  return replacement;
}

// How many blocks more a tree over n triangles may have. Of its B blocks' 4 B nodes, n + B - 1 are not
// imaginary.
std::int64_t blocks_to_spend(std::size_t triangles, std::size_t blocks, double share) {
  const auto n = static_cast<double>(triangles);
  const double most = 3 - 4 * share > 0 ? (n - 1) / (3 - 4 * share) : 4 * n;
  return static_cast<std::int64_t>(most) - static_cast<std::int64_t>(blocks);
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

}  // namespace

Topology build_mixed_tree(std::span<const Bounds> bounds, double share) {
  const Topology minimal = build_minimal_tree(bounds);
  const WorkingTree tree(minimal, bounds);
  const std::vector<Region> regions = cut_into_regions(tree, kMostTriangles);
  const std::size_t count = regions.size() - (regions.size() > 1);  // without the blocks above them
  std::vector<Replacement> replacements(count);
  oneapi::tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    replacements[i] = free_instead_of(tree, regions[i], bounds);
  });
  std::sort(replacements.begin(), replacements.end(), [](const Replacement& a, const Replacement& b) {
    return a.worth() != b.worth() ? a.worth() > b.worth() : a.root < b.root;
  });
  std::int64_t budget = blocks_to_spend(bounds.size(), minimal.size(), share);
  std::vector<const Topology*> instead(minimal.size(), nullptr);
  for (const Replacement& replacement : replacements) {
    if (replacement.saving <= 0 || replacement.more_blocks > budget) continue;
    budget -= replacement.more_blocks;
    instead[replacement.root] = &replacement.topology;
  }
  return Splice(minimal, instead).run();
}

}  // namespace tandem::build
