#pragma once
#include <memory>
#include <string>
#include <vector>

#include "library_engine.h"

namespace tandem {

/// The names of FCL, and of Coal, which was made from FCL. A library derives from it, and adds transform(),
/// which makes a Transform of a pose, and distance(), which asks for the distance of two models.
template <template <typename> typename ModelOf, typename VertexOf, typename TriangleOf, typename TransformOf>
struct BvhLibrary {
  template <typename Volume>
  using Model = ModelOf<Volume>;
  using Vertex = VertexOf;
  using Triangle = TriangleOf;
  using Transform = TransformOf;
};

/// A mesh as such a library keeps it, with the tree of these volumes.
template <typename Library, typename Volume>
struct BvhMesh {
  explicit BvhMesh(const LevelView& level) {
    const IndexedMesh mesh(level);
    std::vector<typename Library::Vertex> vertices;
    std::vector<typename Library::Triangle> triangles;
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 3)
      vertices.emplace_back(mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2]);
    for (std::size_t i = 0; i < mesh.corners.size(); i += 3)
      triangles.emplace_back(mesh.corners[i], mesh.corners[i + 1], mesh.corners[i + 2]);
    model.beginModel(static_cast<unsigned>(triangles.size()), static_cast<unsigned>(vertices.size()));
    model.addSubModel(vertices, triangles);
    model.endModel();
  }

  typename Library::template Model<Volume> model;
};

/// Bodies at rest, with trees of these volumes.
template <typename Library, typename Volume>
class BodiesAtRest : public EngineWith<BvhMesh<Library, Volume>> {
 public:
  using EngineWith<BvhMesh<Library, Volume>>::EngineWith;

 protected:
  const auto* model(std::uint32_t body) const { return &this->shape(body).model; }
  const auto& transform(std::uint32_t body) const { return transforms_[body]; }

 private:
  void place(std::span<const Pose> poses) final {
    transforms_.clear();
    for (const Pose& pose : poses) transforms_.push_back(Library::transform(pose));
  }

  std::vector<typename Library::Transform> transforms_;
};

/// The distances of such a library.
template <typename Library, typename Volume>
class BvhDistances final : public BodiesAtRest<Library, Volume> {
 public:
  /// volume: the library's name of it.
  BvhDistances(std::string_view name, std::string label, std::string volume)
      : BodiesAtRest<Library, Volume>(name), label_(std::move(label)), volume_(std::move(volume)) {}

  std::string label() const override { return label_; }
  std::string settings() const override { return "BVHModel<" + volume_ + ">, relative error 1e-6, float64"; }

 private:
  double distance(std::uint32_t a, std::uint32_t b) override {
    return Library::distance(this->model(a), this->transform(a), this->model(b), this->transform(b));
  }

  const std::string label_, volume_;
};

}  // namespace tandem
