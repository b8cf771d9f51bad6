#include "tandem/kernels/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tandem/formats/box.h"
#include "tandem/kernels/traversal.h"

namespace tandem {
namespace {

// How much each node's half-extent is widened. Coordinates are normalised to [0, 1], so an operation on them
// rounds by at most 2^-24. A node's box is made of a sum, a difference and halves of numbers that are off by
// as much, and tested by a difference and a sum: less than 2^-21 together, and every level of the tree is
// widened anew.
constexpr float kMargin = 0x1p-20f;

constexpr int kCurveBits = 10;  // for each axis
constexpr std::uint32_t kCells = 1u << kCurveBits;

// Node pairs of a block with itself: each once, and no leaf with itself.
constexpr std::uint32_t kUpperWithDiagonal = 0x8CEFu;
constexpr std::uint32_t kUpper = 0x08CEu;

// Spreads ten bits to every third.
std::uint32_t spread(std::uint32_t x) {
  x = (x | x << 16) & 0x030000FFu;
  x = (x | x << 8) & 0x0300F00Fu;
  x = (x | x << 4) & 0x030C30C3u;
  return (x | x << 2) & 0x09249249u;
}

std::uint32_t blocks_over(std::uint32_t count) {
  return (count + kNodesPerBlock - 1) / kNodesPerBlock;
}

// The union of the boxes in a block, widened.
Box box_above(const Block& block) {
  Box box;
  for (int k = 0; k < 3; ++k) {
    float lo = std::numeric_limits<float>::infinity(), hi = -lo;
    for (int i = 0; i < kNodesPerBlock; ++i) {  // an imaginary node changes neither
      lo = std::min(lo, block.center[k][i] - block.half_extent[k][i]);
      hi = std::max(hi, block.center[k][i] + block.half_extent[k][i]);
    }
    box.center[k] = 0.5f * (lo + hi);
    box.half_extent[k] = 0.5f * (hi - lo) + kMargin;
  }
  return box;
}

// All 16 aligned box tests, four lanes at a time. Imaginary nodes fail the ordered comparison.
std::uint32_t aligned_mask(const Block& a, const Block& b) {
  std::uint32_t mask = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    std::uint32_t hit[kNodesPerBlock] = {1, 1, 1, 1};
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < kNodesPerBlock; ++j) {
        const float distance = std::fabs(a.center[k][i] - b.center[k][j]);
        hit[j] &= static_cast<std::uint32_t>(distance <= a.half_extent[k][i] + b.half_extent[k][j]);
      }
    }
    mask |= (hit[0] | hit[1] << 1 | hit[2] << 2 | hit[3] << 3) << 4 * i;
  }
  return mask;
}

}  // namespace

bool BroadPhase::reserve(std::uint32_t boxes) {
  std::uint32_t blocks = 0;
  for (std::uint32_t level = boxes; blocks == 0 || level > 1; blocks += level) level = blocks_over(level);
  bool enough = keys_.resize(boxes) && scratch_.resize(boxes) && blocks_.resize(blocks);
  for (Buffer<float>& ends : ends_) enough = enough && ends.resize(boxes);
  return enough;
}

// Monotone, so that boxes which meet still do.
float BroadPhase::normalise(double x, int axis) const {
  return static_cast<float>((x - origin_[axis]) * scale_);
}

void BroadPhase::sort_along_curve(std::span<const WorldBox> boxes) {
  for (std::uint32_t b = 0; b < boxes.size(); ++b) {
    std::uint32_t curve = 0;
    for (int k = 0; k < 3; ++k) {
      const float center = 0.5f * (normalise(boxes[b].lo[k], k) + normalise(boxes[b].hi[k], k));
      const auto cell = static_cast<std::uint32_t>(center * static_cast<float>(kCells));
      curve |= spread(std::min(cell, kCells - 1)) << k;
    }
    keys_[b] = {curve, b};
  }
  for (int shift = 0; shift < 3 * kCurveBits; shift += kCurveBits) {  // radix sort: stable, least digit first
    std::uint32_t start[kCells] = {};
    const auto digit = [&](const Key& key) { return key.curve >> shift & (kCells - 1); };
    for (const Key& key : keys_.view()) ++start[digit(key)];
    std::uint32_t sum = 0;
    for (std::uint32_t& s : start) sum += std::exchange(s, sum);
    for (const Key& key : keys_.view()) scratch_[start[digit(key)]++] = key;
    std::swap(keys_, scratch_);
  }
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      ends_[k][i] = normalise(boxes[keys_[i].box].lo[k], k);
      ends_[3 + k][i] = normalise(boxes[keys_[i].box].hi[k], k);
    }
  }
}

Box BroadPhase::box_of_leaf(std::uint32_t leaf) const {
  Box box;
  for (int k = 0; k < 3; ++k) {
    box.center[k] = 0.5f * (ends_[k][leaf] + ends_[3 + k][leaf]);
    box.half_extent[k] = 0.5f * (ends_[3 + k][leaf] - ends_[k][leaf]) + kMargin;
  }
  return box;
}

// Writes blocks [begin, begin + blocks_over(children)): node by node the children, which are leaves or blocks
// from first_child on.
void BroadPhase::build_level(std::uint32_t begin, std::uint32_t children, std::uint32_t first_child,
                             NodeKind kind) {
  for (std::uint32_t child = 0; child < blocks_over(children) * kNodesPerBlock; ++child) {
    Block& block = blocks_[begin + child / kNodesPerBlock];
    const int node = static_cast<int>(child % kNodesPerBlock);
    if (child >= children) {
      set_imaginary(block, node);
    } else if (kind == NodeKind::leaf) {
      set_node(block, node, box_of_leaf(child), child, kind);
    } else {
      set_node(block, node, box_above(blocks_[first_child + child]), first_child + child, kind);
    }
  }
}

// A complete tree over the sorted boxes, from the leaf blocks, which lie last, up to the root, block 0.
void BroadPhase::build_tree() {
  auto children = static_cast<std::uint32_t>(keys_.size());
  auto begin = static_cast<std::uint32_t>(blocks_.size());
  std::uint32_t first_child = 0;
  for (NodeKind kind = NodeKind::leaf; begin > 0; kind = NodeKind::internal) {
    begin -= blocks_over(children);
    build_level(begin, children, first_child, kind);
    first_child = begin;
    children = blocks_over(children);
  }
}

// A traversal of the tree against itself. What it leads to is decided by the boxes as they were given.
bool BroadPhase::collect(std::span<const WorldBox> boxes) {
  LevelView tree;
  tree.blocks = blocks_.data();
  tree.block_count = static_cast<std::uint32_t>(blocks_.size());
  const auto test = [](const Block& a, const Block& b) {
    const std::uint32_t mask = aligned_mask(a, b);
    if (&a != &b) return mask;
    return mask & (a.is_leaf_block() ? kUpper : kUpperWithDiagonal);
  };
  bool enough = true;
  found_.clear();
  traverse(tree, tree, test, [&](const Block& leaves_a, const Block& leaves_b, std::uint32_t mask) {
    for (; mask != 0; mask &= mask - 1) {
      const int bit = lowest_bit(mask);
      const std::uint32_t a = keys_[leaves_a.index[bit / 4]].box;
      const std::uint32_t b = keys_[leaves_b.index[bit % 4]].box;
      if (overlap(boxes[a], boxes[b])) enough = enough && found_.push({std::min(a, b), std::max(a, b)});
    }
    return enough;
  });
  return enough && found_.size() < kNoIndex;
}

// Counting sort by a; the few pairs of each a are then sorted by b.
bool BroadPhase::sort_pairs(std::size_t boxes) {
  if (!first_.resize(boxes) || !pairs_.resize(found_.size())) return false;
  std::fill_n(first_.data(), boxes, 0u);
  for (const ObjectPair& pair : found_.view()) ++first_[pair.a];
  std::uint32_t sum = 0;
  for (std::size_t a = 0; a < boxes; ++a) sum += std::exchange(first_[a], sum);
  for (const ObjectPair& pair : found_.view()) pairs_[first_[pair.a]++] = pair;
  const auto by_b = [](const ObjectPair& x, const ObjectPair& y) { return x.b < y.b; };
  std::uint32_t begin = 0;
  for (std::size_t a = 0; a < boxes; begin = first_[a++])
    std::sort(pairs_.data() + begin, pairs_.data() + first_[a], by_b);
  return true;
}

Status BroadPhase::find_pairs(std::span<const WorldBox> boxes) {
  pairs_.clear();
  if (boxes.size() >= kNoIndex) return Status::kOutOfRange;
  double longest = 0;
  for (const WorldBox& box : boxes) {
    if (!in_range(box)) return Status::kOutOfRange;
  }
  for (int k = 0; k < 3; ++k) {
    double lo = std::numeric_limits<double>::infinity(), hi = -lo;
    for (const WorldBox& box : boxes) {
      lo = std::min(lo, box.lo[k]);
      hi = std::max(hi, box.hi[k]);
    }
    origin_[k] = lo;
    longest = std::max(longest, hi - lo);
  }
  if (boxes.size() < 2) return Status::kOk;
  scale_ = longest > 1e-300 ? 1 / longest : 0;  // in a scene that small every box may meet every other
  if (!reserve(static_cast<std::uint32_t>(boxes.size()))) return Status::kOutOfMemory;
  sort_along_curve(boxes);
  build_tree();
  return collect(boxes) && sort_pairs(boxes.size()) ? Status::kOk : Status::kOutOfMemory;
}

}  // namespace tandem
