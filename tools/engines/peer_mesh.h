#pragma once
#include <span>
#include <vector>

#include "peer.h"

namespace tandem::bench {

/// An asset's level 0 as other libraries take it: corners that coincide share a vertex; triangles in leaf
/// order.
struct IndexedMesh {
  std::vector<float> vertices;  ///< x y z, stored coordinates
  std::vector<int> corners;     ///< three for each triangle

  std::size_t vertex_count() const { return vertices.size() / 3; }
  std::size_t triangle_count() const { return corners.size() / 3; }
};

IndexedMesh index_mesh(const LevelView& level);

/// The poses of the instances' stored coordinates, from those of their files' coordinates.
std::vector<Pose> stored_poses(std::span<const AssetView> assets, std::span<const Instance> instances);

/// Float64 corners in the world: the definition that "exact" refers to.
struct PosedTriangle {
  double corner[3][3];
};

inline PosedTriangle posed(const Pose& stored_pose, const Triangle& triangle) {
  PosedTriangle out;
  for (int i = 0; i < 3; ++i) {
    const float* v = triangle.corner[i].position;
    apply(stored_pose, v[0], v[1], v[2], out.corner[i]);
  }
  return out;
}

}  // namespace tandem::bench
