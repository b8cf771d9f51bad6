#pragma once
#include <fcl/geometry/bvh/BVH_model.h>

#include <memory>
#include <vector>

#include "library_engine.h"

namespace tandem {

/// A mesh as FCL keeps it, with the tree of these volumes.
template <typename Volume>
std::shared_ptr<fcl::BVHModel<Volume>> fcl_model(const LevelView& level) {
  const IndexedMesh mesh = index_mesh(level);
  std::vector<fcl::Vector3d> vertices;
  std::vector<fcl::Triangle> triangles;
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 3)
    vertices.emplace_back(mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2]);
  for (std::size_t i = 0; i < mesh.corners.size(); i += 3)
    triangles.emplace_back(mesh.corners[i], mesh.corners[i + 1], mesh.corners[i + 2]);
  auto model = std::make_shared<fcl::BVHModel<Volume>>();
  model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
  model->addSubModel(vertices, triangles);
  model->endModel();
  return model;
}

inline fcl::Transform3d fcl_transform(const Pose& pose) {
  fcl::Transform3d out = fcl::Transform3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.linear()(i, j) = pose.rotation[i][j];
    out.translation()[i] = pose.translation[i];
  }
  return out;
}

}  // namespace tandem
