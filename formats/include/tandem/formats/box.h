#pragma once
#include <cmath>
#include <cstdint>
#include <cstring>

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

/// Returns the smallest float for which [centre - it, centre + it] contains [c - h, c + h] in real
/// arithmetic. This is the one place where boxes are rounded, and they are rounded outward.
///
/// With d + e = |c - centre| and s + f = d + h exactly (Knuth's two-sum: nothing overflows by the condition,
/// and sums of floats that are subnormal are exact), what is asked for is s + (e + f). Let g be the gap below
/// s, which is at least d. Rounding down to d and s took at most half of a gap: e, f >= -g / 2. So where e +
/// f is negative, s is the smallest, or the float below it where both are exactly -g / 2. Where it is
/// positive, it is at most the gap above s, and the float above s is the smallest. Rounding keeps the sign of
/// e + f. Condition: h >= 0, and both intervals are of boxes within +-kMaxCoordinate.
TANDEM_HD inline float half_extent_around(float centre, float c, float h) {
  const float x = c > centre ? c : centre, y = c > centre ? centre : c;
  const float d = x - y, y_part = x - d, e = (x - (d + y_part)) + (y_part - y);
  const float s = d + h, h_part = s - d, f = (d - (s - h_part)) + (h - h_part);
  std::uint32_t bits, bits_below;
  std::memcpy(&bits, &s, sizeof bits);
  bits_below = bits - 1;
  float below;  // NaN where s is 0, and so are e and f
  std::memcpy(&below, &bits_below, sizeof below);
  bits += static_cast<std::uint32_t>(e + f > 0) - static_cast<std::uint32_t>(e == f && e + f == below - s);
  float out;
  std::memcpy(&out, &bits, sizeof out);
  return out;
}

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
  /// The reach that says how far posing rounds a vertex: the same, but where the vertices are float64 numbers
  /// that triangles hold rounded (widen_for_rounding()).
  double posed_reach[3];
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
    extent.posed_reach[k] = extent.reach[k];
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
