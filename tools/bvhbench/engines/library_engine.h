#pragma once
#include <memory>

#include "engine.h"

namespace tandem {

/// An asset's level 0 as other libraries take it: corners that coincide share a vertex, unless they
/// are of different source vertices; triangles in leaf order.
struct IndexedMesh {
  explicit IndexedMesh(const LevelView& level);

  std::vector<float> vertices;  ///< x y z, stored coordinates
  std::vector<int> corners;     ///< three for each triangle

  std::size_t vertex_count() const { return vertices.size() / 3; }
  std::size_t triangle_count() const { return corners.size() / 3; }
};

/// Float64 corners in the world: the definition that "exact" refers to.
struct PosedTriangle {
  double corner[3][3];
};

/// Someone else's collision library, on one thread, which Tandem's broad phase on the CPU tells the pairs of
/// bodies. It says how a pair is asked, by the function of its question: collide(), distance() or impact().
class LibraryEngine : public Engine {
 public:
  using Engine::Engine;

  void set_shapes(std::span<const AssetView> shapes) final;
  void update(std::span<const BodyPose> bodies) final;
  std::span<const ObjectPair> find_pairs() final;
  void query(std::span<const ObjectPair> pairs) override;
  bool contacts(std::vector<TriangleContact>& found) override;
  void find_distances(std::span<const ObjectPair> pairs, std::vector<double>& distances) override;
  void find_impacts(std::span<const ObjectPair> pairs, std::vector<double>& times) final;
  std::vector<Counter> named_counters() const override { return {{"candidates", candidates_}}; }

 protected:
  std::optional<double> deform_one(std::uint32_t shape, const VertexPositions& positions) final;

  /// Forgets all shapes.
  virtual void clear_shapes() = 0;

  /// Makes what the library keeps of the next shape.
  virtual void add_shape(const LevelView& level) = 0;

  /// Makes what the library keeps of each body, of shape_of(), and places it.
  virtual void make_bodies(std::span<const Pose> poses) { place(poses); }

  /// Moves the bodies. `poses` speak of stored coordinates.
  virtual void place(std::span<const Pose> poses) = 0;

  /// Moves the vertices of a shape, x y z of each, which are those of its IndexedMesh, and refits its tree.
  virtual void move_vertices(std::uint32_t /*shape*/, std::span<const double> /*vertices*/) {
    cannot("deform shapes");
  }

  /// Lets the bodies of a shape whose vertices have moved follow. `poses`, of all bodies, are as for place().
  virtual void follow(std::uint32_t /*shape*/, std::span<const Pose> poses) { place(poses); }

  /// Adds the contacts of bodies a and b to contacts_, and what was looked at to candidates_.
  virtual void collide(std::uint32_t /*pair*/, std::uint32_t /*a*/, std::uint32_t /*b*/) {
    cannot("find contacts");
  }

  /// The distance of bodies a and b, 0 or less where they meet.
  virtual double distance(std::uint32_t /*a*/, std::uint32_t /*b*/) { cannot("find distances"); }

  /// Returns when bodies a and b meet, in seconds; infinite where they do not.
  virtual double impact(std::uint32_t /*a*/, std::uint32_t /*b*/) { cannot("find impacts"); }

  /// The shape of each body.
  std::span<const std::uint32_t> shape_of() const { return shape_of_; }

  /// Returns where a body is at the end of the step; the pose speaks of stored coordinates.
  Pose end_of_step(std::uint32_t body) const;

  void add_contact(std::uint32_t pair, std::uint64_t triangle_a, std::uint64_t triangle_b) {
    contacts_.push_back(
        {pair, static_cast<std::uint32_t>(triangle_a), static_cast<std::uint32_t>(triangle_b)});
  }

  std::vector<TriangleContact> contacts_;
  std::uint64_t candidates_ = 0;

 private:
  /// A shape whose vertices move: their source vertices, and where they are.
  struct MovingVertices {
    std::vector<std::uint32_t> source;
    std::vector<double> position;  ///< x y z, in the file's coordinates
  };

  MovingVertices& moving_vertices(std::uint32_t shape);
  const double (&origin_of(std::uint32_t shape) const)[3];
  std::vector<Pose> stored_poses(std::span<const BodyPose> bodies) const;

  std::span<const BodyPose> bodies_;
  std::vector<AssetView> shapes_;
  std::vector<MovingVertices> moving_;  ///< of each shape, empty until it is deformed; none where none is
  std::vector<std::uint32_t> shape_of_;
  std::unique_ptr<Scene> scene_;  ///< made when pairs are asked for
};

/// A library that keeps a Shape, made of a level, of each shape.
template <typename Shape>
class EngineWith : public LibraryEngine {
 public:
  using LibraryEngine::LibraryEngine;

 protected:
  const Shape& shape(std::uint32_t body) const { return *kept_[shape_of()[body]]; }
  Shape& kept(std::uint32_t shape) { return *kept_[shape]; }
  void clear_shapes() override { kept_.clear(); }

 private:
  void add_shape(const LevelView& level) final { kept_.push_back(std::make_unique<Shape>(level)); }

  std::vector<std::unique_ptr<Shape>> kept_;
};

}  // namespace tandem
