#include <algorithm>
#include <cstdlib>
#include <optional>

#include "parallel/parallel.h"
#include "working_tree.h"

namespace tandem::build {
namespace {

// Triangles of the smallest subtrees that are replaced: of more than a few blocks, or a free tree would have
// no freedom. The next larger ones have up to four times as many.
constexpr std::uint32_t kFewTriangles = 64;

using Builder = Topology (*)(std::span<const Bounds>);

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
Replacement replacement_of(const WorkingTree& tree, const Region& region, std::span<const Bounds> bounds,
                           const Builder& build) {
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
  const WorkingTree other(replacement.topology, their_bounds);
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

// How many blocks a tree over n triangles has at most if no more than `share` of its nodes are imaginary: of
// B blocks' 4 B nodes, n + B - 1 are not.
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

// Which subtrees are replaced; none lies in another.
class Replaced {
 public:
  explicit Replaced(const WorkingTree& tree)
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
  const WorkingTree& tree_;
  std::vector<const Topology*> instead_;
  std::vector<std::uint8_t> holds_one_;
};

// Other trees instead of the largest subtrees of at most `most_triangles` triangles.
void add_replacements(const WorkingTree& tree, std::span<const Bounds> bounds, std::uint32_t most_triangles,
                      const Builder& build, std::vector<Replacement>& all) {
  const std::vector<Region> regions = cut_into_regions(tree, most_triangles);
  const std::size_t count = regions.size() - (regions.size() > 1);  // without the blocks above them
  const std::size_t first = all.size();
  all.resize(first + count);
  parallel::for_each(
      count, [&](std::size_t i) { all[first + i] = replacement_of(tree, regions[i], bounds, build); });
}

// Those that fit, the most worth first.
void sort_by_worth(std::vector<Replacement>& replacements) {
  std::erase_if(replacements, [](const Replacement& replacement) { return !replacement.fits; });
  std::sort(replacements.begin(), replacements.end(), [](const Replacement& a, const Replacement& b) {
    return a.worth() != b.worth() ? a.worth() > b.worth() : a.root < b.root;
  });
}

// The free tree with as many subtrees minimal as it takes, where that costs least; nothing if that does not
// do.
std::optional<Topology> mostly_free(std::span<const Bounds> bounds, std::int64_t most_blocks) {
  const Topology free = build_free_tree(bounds);
  const WorkingTree tree(free, bounds);
  std::vector<Replacement> replacements;
  add_replacements(tree, bounds, kFewTriangles, build_minimal_tree, replacements);
  sort_by_worth(replacements);
  std::int64_t too_many = static_cast<std::int64_t>(free.size()) - most_blocks;
  Replaced replaced(tree);
  for (const Replacement& replacement : replacements) {
    if (too_many <= 0 && replacement.saving <= 0) break;
    too_many += replacement.more_blocks;
    replaced.take(replacement);
  }
  if (too_many > 0) return std::nullopt;
  return Splice(free, replaced.instead()).run();
}

// The minimal tree with subtrees of all sizes free where that saves most for a block.
Topology mostly_minimal(std::span<const Bounds> bounds, std::int64_t most_blocks) {
  const Topology minimal = build_minimal_tree(bounds);
  const WorkingTree tree(minimal, bounds);
  std::vector<Replacement> replacements;
  for (std::uint64_t size = kFewTriangles; size / 4 < bounds.size(); size *= 4) {
    const auto most_triangles = static_cast<std::uint32_t>(std::min<std::uint64_t>(size, ~0u));
    add_replacements(tree, bounds, most_triangles, build_free_tree, replacements);
  }
  sort_by_worth(replacements);
  std::int64_t budget = most_blocks - static_cast<std::int64_t>(minimal.size());
  Replaced replaced(tree);
  for (const Replacement& replacement : replacements) {
    if (replacement.saving <= 0 || replacement.more_blocks > budget || !replaced.is_free(replacement.root))
      continue;
    budget -= replacement.more_blocks;
    replaced.take(replacement);
  }
  return Splice(minimal, replaced.instead()).run();
}

}  // namespace

Topology build_mixed_tree(std::span<const Bounds> bounds, double share) {
  const std::int64_t most_blocks = blocks_within(bounds.size(), share);
  if (std::optional<Topology> tree = mostly_free(bounds, most_blocks)) return std::move(*tree);
  return mostly_minimal(bounds, most_blocks);
}

}  // namespace tandem::build
