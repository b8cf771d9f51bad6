#include "minimal_tree.h"

#include <oneapi/tbb/parallel_invoke.h>

#include "emit.h"
#include "legal_splits.h"
#include "splitter.h"
#include "tandem/formats/box.h"

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

template <typename Left, typename Right>
void maybe_parallel(bool parallel, const Left& left, const Right& right) {
  if (parallel) {
    oneapi::tbb::parallel_invoke(left, right);
  } else {
    left();
    right();
  }
}

class Builder {
 public:
  explicit Builder(const Geometry& geometry) : geometry_(geometry), splitter_(geometry) {}

  Tree run() {
    const auto n = static_cast<std::uint32_t>(geometry_.triangles.size());
    tree_.blocks.resize(blocks_for(n));
    build_block({0, n}, 0, 1);
    tree_.order = splitter_.take_order();
    measure(tree_);
    return std::move(tree_);
  }

 private:
  // Builds the tree over the group into blocks [block, block + blocks_for(n)).
  void build_block(Range range, std::uint32_t block, std::uint32_t depth) {
    if (range.size() <= kNodesPerBlock) {
      emit_leaf_block(tree_.blocks[block], geometry_, splitter_.order({0, 0}).data(), range.begin,
                      range.size());
      return;
    }
    const Groups groups = split(range, kNodesPerBlock, depth);
    std::uint32_t child[kNodesPerBlock + 1] = {block + 1};
    for (int i = 0; i < groups.count; ++i) child[i + 1] = child[i] + blocks_for(groups.range[i].size());
    build_children(groups, child, 0, groups.count, depth);
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (i < groups.count) {
        emit_internal_node(tree_.blocks, block, i, child[i]);
      } else {
        set_imaginary(tree_.blocks[block], i);
      }
    }
  }

  void build_children(const Groups& groups, const std::uint32_t* child, int first, int last,
                      std::uint32_t depth) {
    if (last - first == 1) return build_block(groups.range[first], child[first], depth + 1);
    const int middle = (first + last) / 2;
    maybe_parallel(
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
    maybe_parallel(
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

  Geometry geometry_;
  TriangleSplitter splitter_;
  Tree tree_;
};

}  // namespace

Tree build_minimal_tree(const Geometry& geometry) {
  return Builder(geometry).run();
}

}  // namespace tandem::build
