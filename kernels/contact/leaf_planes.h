#pragma once
#include "kernels/common/traversal.h"
#include "kernels/geometry/frame_test.h"
#include "tandem/formats/view.h"

/// Planes of leaves: a node that lies beyond the plane of a triangle holds nothing that meets it. They spare
/// the most where the triangle is much larger than the nodes, see worth_planes().
namespace tandem {

/// The corners of a stored triangle, in its own mesh.
struct TriangleInFrame {
  frame::Point<float> corner[3];
};

TANDEM_HD inline TriangleInFrame stored_triangle(const Triangle& triangle) {
  TriangleInFrame out;
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < 3; ++k) out.corner[c].x[k] = triangle.corner[c].position[k];
  }
  return out;
}

/// The images of the corners of a triangle of b in a's frame.
TANDEM_HD inline TriangleInFrame posed_triangle(const RelativePose& b_in_a, const Triangle& triangle) {
  TriangleInFrame out = stored_triangle(triangle);
  for (frame::Point<float>& corner : out.corner) corner = frame::posed(b_in_a, corner);
  return out;
}

TANDEM_HD inline frame::BoxInFrame<float> stored_box(const Block& block, int node) {
  frame::BoxInFrame<float> out;
  for (int k = 0; k < 3; ++k) {
    out.centre[k] = block.centre[k][node];
    out.half_extent[k] = block.half_extent[k][node];
  }
  return out;
}

/// Returns the hits of a leaf block and an internal one, less those of nodes that lie beyond the plane of the
/// triangle. A bit of `hits` stands for a node pair, as in BlockPair. triangles_a, triangles_b: of the trees;
/// error: frame_error().
TANDEM_HD inline std::uint32_t drop_beyond_planes(const Block& a, const Block& b, std::uint32_t hits,
                                                  const Triangle* triangles_a, const Triangle* triangles_b,
                                                  const RelativePose& b_in_a, float error) {
  const bool leaf_a = a.is_leaf_block();
  std::uint32_t left = hits;
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
  for (; hits != 0; hits &= hits - 1) {
    const int bit = lowest_bit(hits), i = bit / 4, j = bit % 4;
    const TriangleInFrame t =
        leaf_a ? stored_triangle(triangles_a[a.index[i]]) : posed_triangle(b_in_a, triangles_b[b.index[j]]);
    const frame::BoxInFrame<float> box = leaf_a ? frame::posed(b_in_a, stored_box(b, j)) : stored_box(a, i);
    const frame::Plane<float, true> plane(t.corner[0], t.corner[1], t.corner[2], error);
    if (frame::beyond(plane, box, error)) left &= ~(1u << bit);
  }
  return left;
}

}  // namespace tandem
