#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "kernels/random_rotation.h"
#include "tandem/formats/box.h"
#include "tandem/formats/oriented_block.h"

/// An oriented block with few vertices below its first node, as bvhbuild would make it.
namespace tandem::test {

struct OrientedBody {
  std::vector<std::array<float, 3>> vertices;
  TreeExtent extent;
  OrientedBlock block;  ///< nodes 1 to 3 are imaginary
};

inline void set_imaginary(OrientedBlock& block, int node) {
  for (int k = 0; k < 3; ++k) {
    block.center[k][node] = kImaginaryCenter;
    block.half_extent[k][node] = kImaginaryHalfExtent;
  }
}

/// The box of node 0 around the vertices, and a tree that reaches as far as they do.
inline void enclose_vertices(OrientedBody& body, const BlockRotation& rotation) {
  Position lo, hi;
  for (int k = 0; k < 3; ++k) {
    lo[k] = hi[k] = body.vertices[0][k];
    for (const auto& vertex : body.vertices)
      lo[k] = std::min(lo[k], vertex[k]), hi[k] = std::max(hi[k], vertex[k]);
  }
  Block root;
  set_node(root, 0, enclose(lo, hi), 0, NodeKind::leaf);
  for (int node = 1; node < kNodesPerBlock; ++node) set_imaginary(root, node);
  body.extent = extent_of(root);
  double squared = 0;
  for (const double reach : body.extent.reach) squared += reach * reach;
  const ScaledRotation scaled = scaled_rotation(rotation);
  body.block = {};
  for (int node = 1; node < kNodesPerBlock; ++node) set_imaginary(body.block, node);
  for (int k = 0; k < 3; ++k) {
    double lowest = HUGE_VAL, highest = -HUGE_VAL;
    for (const auto& vertex : body.vertices) {
      const float x[3] = {vertex[0], vertex[1], vertex[2]};
      const double at = along_axis(scaled, k, x);
      lowest = std::min(lowest, at), highest = std::max(highest, at);
    }
    box_along(lowest, highest, std::sqrt(squared), body.block.center[k][0], body.block.half_extent[k][0]);
  }
  body.block.rotation = rotation;
  body.block.size = oriented_size(body.block);
}

}  // namespace tandem::test
