#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "bvhbuild/meshing/triangle_mesh.h"

namespace tandem::build {

/// A coarser mesh, in the stored coordinates of the asset.
struct LevelMesh {
  std::vector<std::array<float, 3>> points;
  std::vector<TriangleIndices> triangles;
  std::vector<std::uint32_t> was;  ///< of each triangle: the one of level 0, in leaf order, that became it
};

}  // namespace tandem::build
