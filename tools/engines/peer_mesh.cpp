#include "peer_mesh.h"

#include <array>
#include <map>

namespace tandem::bench {

IndexedMesh index_mesh(const LevelView& level) {
  IndexedMesh mesh;
  std::map<std::array<float, 3>, int> index_of;
  for (const Triangle& triangle : std::span(level.triangles, level.triangle_count)) {
    for (const Triangle::Corner& corner : triangle.corner) {
      const std::array<float, 3> position = {corner.position[0], corner.position[1], corner.position[2]};
      const auto [found, is_new] = index_of.try_emplace(position, static_cast<int>(mesh.vertex_count()));
      if (is_new) mesh.vertices.insert(mesh.vertices.end(), position.begin(), position.end());
      mesh.corners.push_back(found->second);
    }
  }
  return mesh;
}

std::vector<Pose> stored_poses(std::span<const AssetView> assets, std::span<const Instance> instances) {
  std::vector<Pose> poses;
  poses.reserve(instances.size());
  for (const Instance& instance : instances) {
    poses.push_back(for_stored_coordinates(instance.pose, assets[instance.asset].header->origin));
  }
  return poses;
}

}  // namespace tandem::bench
