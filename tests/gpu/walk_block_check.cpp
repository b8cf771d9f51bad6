#include "walk_block_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/random_rotation.h"

namespace tandem::test {
namespace {

constexpr Real kTiny = 0x1p-149L;  // float32 ends there

/// What lies from `lowest` to `highest` along the axes of a frame.
struct Extents {
  Real lowest[3] = {HUGE_VALL, HUGE_VALL, HUGE_VALL}, highest[3] = {-HUGE_VALL, -HUGE_VALL, -HUGE_VALL};

  Real of(int k) const { return highest[k] - lowest[k]; }
};

Extents extents_of(const std::vector<const Triangle*>& triangles, const std::array<Direction, 3>& axes) {
  Extents out;
  for (const Triangle* triangle : triangles) {
    for (const Triangle::Corner& corner : triangle->corner) {
      for (int k = 0; k < 3; ++k) {
        Real at = 0;
        for (int i = 0; i < 3; ++i) at += axes[k][i] * corner.position[i];
        out.lowest[k] = std::min(out.lowest[k], at);
        out.highest[k] = std::max(out.highest[k], at);
      }
    }
  }
  return out;
}

class Checker {
 public:
  Checker(const LevelView& tree, const WalkTree& walk)
      : tree_(tree), walk_(walk), named_(walk.blocks.size()) {
    Real squared = 0;
    for (const double reach : extent_of(tree.blocks[0]).reach) squared += static_cast<Real>(reach) * reach;
    farthest_ = std::sqrt(squared);
  }

  void run() {
    EXPECT_EQ(walk_.root, walk_.first);
    visit(walk_.root, 0);
    EXPECT_EQ(visited_, tree_.block_count);
  }

 private:
  using Below = std::vector<const Triangle*>;

  // Result: the triangles below the block.
  Below visit(std::uint32_t number, std::uint32_t at) {
    const std::uint64_t end = walk_.first + gpu::numbers_of(tree_);
    if (number < walk_.first || number >= end || number >= walk_.blocks.size()) {
      ADD_FAILURE() << "block " << at << " has number " << number << " of " << walk_.first << " to " << end;
      return {};
    }
    EXPECT_FALSE(named_[number]) << "number " << number << " twice";
    named_[number] = true;
    ++visited_;
    EXPECT_EQ(walk_.file_blocks[number], at);
    const Block& block = tree_.blocks[at];
    const std::uint32_t first_below = walk_.blocks[number].first_below;
    EXPECT_EQ((first_below & gpu::kIsLeafBlock) != 0, block.is_leaf_block()) << "block " << at;
    Below all, below[kNodesPerBlock];
    for (int node = 0; node < kNodesPerBlock; ++node) {
      if (block.kind[node] == NodeKind::imaginary) continue;
      const std::uint32_t expected = (first_below & ~gpu::kIsLeafBlock) + static_cast<std::uint32_t>(node);
      if (block.is_leaf_block()) {
        EXPECT_EQ(block.index[node], expected) << "block " << at;
        below[node] = {&tree_.triangles[block.index[node]]};
      } else {
        below[node] = visit(expected, block.index[node]);
      }
      all.insert(all.end(), below[node].begin(), below[node].end());
    }
    SCOPED_TRACE(testing::Message() << "walk block " << number << ", block " << at);
    check_boxes(walk_.blocks[number], block, below);
    return all;
  }

  void check_boxes(const gpu::WalkBlock& walk, const Block& block, const Below (&below)[kNodesPerBlock]) {
    const Quaternion q = unpacked(walk.rotation);
    for (const int part : q) ASSERT_LE(std::abs(part), kLargestQuaternionPart);
    ASSERT_NE(q, (Quaternion{0, 0, 0, 0}));
    const auto axes = axes_of(frame_of(walk.rotation));
    const BlockRotation none = no_rotation();
    // Along the mesh's own axes nothing is rounded, and boxes are those of the file.
    const bool turned = walk.rotation.wx != none.wx || walk.rotation.yz != none.yz;
    Real rim = 0, real_nodes = 0, surface = 0, cost = 0, cost_of_mesh = 0;
    for (int node = 0; node < kNodesPerBlock && block.kind[node] != NodeKind::imaginary;
         ++node, ++real_nodes) {
      for (int k = 0; k < 3; ++k) rim += block.half_extent[k][node] / Real{2};
    }
    rim /= real_nodes;
    for (int node = 0; node < kNodesPerBlock; ++node) {
      const float h[3] = {walk.half_extent[0][node], walk.half_extent[1][node], walk.half_extent[2][node]};
      if (block.kind[node] == NodeKind::imaginary) {
        for (int k = 0; k < 3; ++k) {
          EXPECT_EQ(walk.center[k][node], kImaginaryCenter);
          EXPECT_EQ(h[k], kImaginaryHalfExtent);
        }
        continue;
      }
      const Extents own = extents_of(below[node], axes);
      for (int k = 0; k < 3; ++k) {
        check_interval(own, k, walk.center[k][node], h[k], turned);
        if (turned) continue;
        EXPECT_EQ(walk.center[k][node], block.center[k][node]);
        EXPECT_EQ(h[k], block.half_extent[k][node]);
      }
      surface = std::max(surface, (Real{h[0]} * h[1] + Real{h[1]} * h[2]) + Real{h[2]} * h[0]);
      cost += (h[0] + rim) * (h[1] + rim) * (h[2] + rim);
      cost_of_mesh += (block.half_extent[0][node] + rim) * (block.half_extent[1][node] + rim) *
                      (block.half_extent[2][node] + rim);
    }
    // Computed in float32, within whose range alone they mean anything.
    if (farthest_ >= 0x1p60L || farthest_ <= 0x1p-60L) return;
    EXPECT_LE(std::fabs(walk.size - std::sqrt(surface)), 1e-5L * std::sqrt(surface) + 0x1p-24L * rim);
    EXPECT_LE(cost, cost_of_mesh * (1 + 1e-5L));
  }

  void check_interval(const Extents& own, int k, float c, float h, bool turned) {
    // Coordinates here are off by less than 2^-61 of their size, and boxes of turned frames hold 2^-49 of it
    // more.
    const Real below = c - own.lowest[k], above = own.highest[k] - c;
    EXPECT_LE(std::max(below, above) + (turned ? 0x1p-60L * farthest_ : 0), h + kTiny);
    if (!turned) return;
    EXPECT_LE(h, own.of(k) / 2 * (1 + 0x1p-21L) + 0x1p-23L * farthest_ + 2 * kTiny);
  }

  const LevelView& tree_;
  const WalkTree& walk_;
  std::vector<bool> named_;  // numbers
  std::uint32_t visited_ = 0;
  Real farthest_;
};

}  // namespace

void expect_walk_blocks(const LevelView& tree, const WalkTree& walk) {
  Checker(tree, walk).run();
}

}  // namespace tandem::test
