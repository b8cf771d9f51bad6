#pragma once
#include <cmath>

#include "tandem/formats/block.h"

namespace tandem {

/// An axis-aligned box as a node stores it: the set [centre - half_extent, centre + half_extent] in real
/// arithmetic.
struct Box {
  float centre[3];
  float half_extent[3];
};

/// A corner point of a triangle, or any other stored position.
using Position = float[3];

/// The largest magnitude of a stored coordinate. It is 2^-12 below the largest float, so that no box
/// overflows: a node's box grows by at most an ulp for its centre and one for its half-extent on each of
/// kMaxDepth levels, 2^7 * 2^104 in all, and 2^115 are spare.
inline constexpr float kMaxCoordinate = 0x1.fffp127f;

/// The box around the rounded midpoint that contains lo and hi exactly, with the smallest half-extents that
/// do. Condition: lo[k] <= hi[k], magnitudes at most kMaxCoordinate. Then the result is finite.
Box enclose(const Position& lo, const Position& hi);

/// A box that contains the boxes of all real nodes of `block` in real arithmetic, with the smallest
/// half-extents around its centre. Condition: the block has a real node. The result is finite if the boxes
/// come from enclose() (see kMaxCoordinate).
Box enclose(const Block& block);

/// Returns whether [c - h, c + h] on every axis contains the point, in real arithmetic: no rounding decides
/// it.
bool contains(const Box& box, const Position& point);

/// Returns whether `outer` contains `inner`, in real arithmetic: |c_i - c_o| + h_i <= h_o on every axis.
bool contains(const Box& outer, const Box& inner);

/// Returns whether it is the box of an imaginary node, bit by bit.
bool is_imaginary_box(const Box& box);

TANDEM_HD inline Box box_of(const Block& block, int node) {
  return {{block.centre[0][node], block.centre[1][node], block.centre[2][node]},
          {block.half_extent[0][node], block.half_extent[1][node], block.half_extent[2][node]}};
}

/// The extent of all boxes of a tree. Every box lies in a box of the root block, so the root block gives it.
struct TreeExtent {
  double reach[3];        ///< >= |centre| + half_extent
  double half_extent[3];  ///< >= half_extent
};

/// The extent of the tree with this root block.
TANDEM_HD inline TreeExtent extent_of(const Block& root) {
  TreeExtent extent{};
  for (int k = 0; k < 3; ++k) {
    for (int node = 0; node < kNodesPerBlock; ++node) {
      if (root.kind[node] == NodeKind::imaginary) continue;
      const double h = root.half_extent[k][node];
      // Rounded to nearest, twice: the factor makes up for both.
      const double reach = (std::fabs(static_cast<double>(root.centre[k][node])) + h) * (1 + 0x1p-50);
      if (reach > extent.reach[k]) extent.reach[k] = reach;
      if (h > extent.half_extent[k]) extent.half_extent[k] = h;
    }
  }
  return extent;
}

/// Writes a real node; `index` is a child block or a triangle.
inline void set_node(Block& block, int node, const Box& box, std::uint32_t index, NodeKind kind) {
  for (int k = 0; k < 3; ++k) {
    block.centre[k][node] = box.centre[k];
    block.half_extent[k][node] = box.half_extent[k];
  }
  block.index[node] = index;
  block.kind[node] = kind;
}

/// Writes an imaginary node.
inline void set_imaginary(Block& block, int node) {
  set_node(block, node,
           {{kImaginaryCentre, kImaginaryCentre, kImaginaryCentre},
            {kImaginaryHalfExtent, kImaginaryHalfExtent, kImaginaryHalfExtent}},
           kNoIndex, NodeKind::imaginary);
}

}  // namespace tandem
