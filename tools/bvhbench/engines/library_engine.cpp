#include "library_engine.h"

#include <algorithm>
#include <array>
#include <map>

namespace tandem {

IndexedMesh::IndexedMesh(const LevelView& level) {
  std::map<std::pair<std::array<float, 3>, std::uint32_t>, int> index_of;
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    for (int c = 0; c < 3; ++c) {
      const float* const corner = level.triangles[t].corner[c].position;
      const std::array<float, 3> position = {corner[0], corner[1], corner[2]};
      const std::uint32_t apart = level.source_vertices != nullptr ? level.topology[t].vertex[c] : 0;
      const auto [found, is_new] = index_of.try_emplace({position, apart}, static_cast<int>(vertex_count()));
      if (is_new) vertices.insert(vertices.end(), position.begin(), position.end());
      corners.push_back(found->second);
    }
  }
}

void LibraryEngine::set_shapes(std::span<const AssetView> shapes) {
  shapes_.assign(shapes.begin(), shapes.end());
  moving_.clear();
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

// The first time, says which source vertex each vertex is.
LibraryEngine::MovingVertices& LibraryEngine::moving_vertices(std::uint32_t shape) {
  moving_.resize(shapes_.size());
  MovingVertices& moving = moving_[shape];
  if (!moving.source.empty()) return moving;
  const LevelView level = shapes_[shape].level();
  if (level.source_vertices == nullptr) require_bent(shape, Status::kNoSourceVertices, shape);
  const IndexedMesh mesh(level);
  moving.source.resize(mesh.vertex_count());
  moving.position.resize(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.corners.size(); ++i) {
    const std::uint32_t vertex = level.topology[i / 3].vertex[i % 3];
    moving.source[static_cast<std::size_t>(mesh.corners[i])] = level.source_vertices[vertex];
  }
  return moving;
}

std::optional<double> LibraryEngine::deform_one(std::uint32_t shape, const VertexPositions& positions) {
  MovingVertices& moving = moving_vertices(shape);
  std::visit(
      [&](const auto& given) {
        if (given.size() != 3 * shapes_[shape].header->source_vertices)
          require_bent(shape, Status::kVertexCountMismatch, given.size() / 3);
        double* position = moving.position.data();
        for (const std::uint32_t source : moving.source)
          position = std::copy_n(&given[3 * std::size_t{source}], 3, position);
      },
      positions);
  move_vertices(shape, moving.position);
  follow(shape, stored_poses(bodies_));
  return {};
}

std::span<const ObjectPair> LibraryEngine::find_pairs() {
  if (!moving_.empty()) cannot("find pairs of bodies that bend");
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
  return for_stored_coordinates(pose_at(at_start.pose, motion_[body], duration_), origin_of(at_start.asset));
}

// Vertices that have moved are in the file's coordinates.
const double (&LibraryEngine::origin_of(std::uint32_t shape) const)[3] {
  static constexpr double kOfTheFile[3] = {0, 0, 0};
  if (!moving_.empty() && !moving_[shape].source.empty()) return kOfTheFile;
  return shapes_[shape].header->origin;
}

// Makes the poses of stored coordinates from those of the files' coordinates.
std::vector<Pose> LibraryEngine::stored_poses(std::span<const BodyPose> bodies) const {
  std::vector<Pose> poses;
  poses.reserve(bodies.size());
  for (const BodyPose& body : bodies) {
    if (body.asset >= shapes_.size()) require(Status::kUnknownAsset, poses.size());
    poses.push_back(for_stored_coordinates(body.pose, origin_of(body.asset)));
  }
  return poses;
}

}  // namespace tandem
