#include "library_engine.h"

#include <algorithm>
#include <array>
#include <map>

namespace tandem {

IndexedMesh::IndexedMesh(const LevelView& level) {
  std::map<std::array<float, 3>, int> index_of;
  for (const Triangle& triangle : std::span(level.triangles, level.triangle_count)) {
    for (const Triangle::Corner& corner : triangle.corner) {
      const std::array<float, 3> position = {corner.position[0], corner.position[1], corner.position[2]};
      const auto [found, is_new] = index_of.try_emplace(position, static_cast<int>(vertex_count()));
      if (is_new) vertices.insert(vertices.end(), position.begin(), position.end());
      corners.push_back(found->second);
    }
  }
}

void LibraryEngine::set_shapes(std::span<const AssetView> shapes) {
  shapes_.assign(shapes.begin(), shapes.end());
  shape_of_.clear();
  scene_.reset();
  clear_shapes();
  for (const AssetView& shape : shapes_) add_shape(shape.level());
}

void LibraryEngine::update(std::span<const BodyPose> bodies) {
  bodies_ = bodies;
  const std::vector<Pose> poses = stored_poses(bodies);
  const auto same = [](const BodyPose& body, std::uint32_t shape) { return body.asset == shape; };
  if (std::equal(bodies.begin(), bodies.end(), shape_of_.begin(), shape_of_.end(), same)) {
    return place(poses);
  }
  shape_of_.clear();
  for (const BodyPose& body : bodies) shape_of_.push_back(body.asset);
  make_bodies(poses);
}

std::span<const ObjectPair> LibraryEngine::find_pairs() {
  Status status = Status::kOk;
  if (scene_ == nullptr) {
    scene_ = std::make_unique<Scene>();
    status = scene_->set_assets(shapes_);
  }
  if (status == Status::kOk) status = scene_->place(bodies_, filter_);
  if (status == Status::kOk) status = scene_->find_pairs();
  require(status, scene_->where());
  return scene_->pairs();
}

void LibraryEngine::query(std::span<const ObjectPair> pairs) {
  contacts_.clear();
  candidates_ = 0;
  for (std::uint32_t pair = 0; pair < pairs.size(); ++pair) collide(pair, pairs[pair].a, pairs[pair].b);
}

bool LibraryEngine::contacts(std::vector<TriangleContact>& found) {
  found = contacts_;
  return true;
}

void LibraryEngine::find_distances(std::span<const ObjectPair> pairs, std::vector<double>& distances) {
  distances.clear();
  for (const auto& [a, b] : pairs) distances.push_back(distance(a, b));
}

void LibraryEngine::find_impacts(std::span<const ObjectPair> pairs, std::vector<double>& times) {
  times.clear();
  for (const auto& [a, b] : pairs) times.push_back(impact(a, b));
}

Pose LibraryEngine::end_of_step(std::uint32_t body) const {
  const BodyPose& at_start = bodies_[body];
  return for_stored_coordinates(pose_at(at_start.pose, motion_[body], duration_),
                                shapes_[at_start.asset].header->origin);
}

// Makes the poses of stored coordinates from those of the files' coordinates.
std::vector<Pose> LibraryEngine::stored_poses(std::span<const BodyPose> bodies) const {
  std::vector<Pose> poses;
  poses.reserve(bodies.size());
  for (const BodyPose& body : bodies) {
    if (body.asset >= shapes_.size()) require(Status::kUnknownAsset, poses.size());
    poses.push_back(for_stored_coordinates(body.pose, shapes_[body.asset].header->origin));
  }
  return poses;
}

}  // namespace tandem
