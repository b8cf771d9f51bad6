#pragma once
#include <span>
#include <vector>

#include "surface.h"
#include "tandem/kernels/pose.h"
#include "triangle_meeting.h"

namespace tandem::simulation {

/// A shape, and what contact generation knows of it from the start.
struct Shape {
  Surface surface;
  LevelView level;
  double origin[3];
  Eigen::Vector3d center;  ///< of the bounds, stored coordinates
  double diagonal;         ///< of the bounds
};

/// One of two bodies that meet: its triangles in the world as they are asked for, and which of its vertices
/// lie inside the other body, found from the edges that pierce the other's surface. Keeps its memory from
/// pair to pair; nothing depends on what was in it.
class BodySide {
 public:
  /// A vertex inside the other body.
  struct Enclosed {
    std::uint32_t vertex;
    std::uint32_t curve;  ///< by which it was reached
    Eigen::Vector3d position;
  };
  /// A triangle all of whose corners are inside.
  struct EnclosedTriangle {
    std::uint32_t corner[3];  ///< in enclosed()
    std::uint32_t curve;
    bool turned;
  };

  void start(const Shape& shape, const Pose& pose);

  const Shape& shape() const { return *shape_; }
  const Eigen::Vector3d& center() const { return center_; }
  double reach() const { return reach_; }  ///< the largest coordinate of its bounds

  /// The slot of a triangle among those asked for.
  std::uint32_t triangle(std::uint32_t index);
  const WorldTriangle& at(std::uint32_t slot) const { return triangles_[slot]; }
  std::span<const WorldTriangle> triangles() const { return triangles_; }

  /// An edge that pierces the other's surface, `at` between its lower and upper vertex.
  void add_piercing(std::uint32_t edge, double at, bool lower_inside, std::uint32_t curve);

  /// Finds the enclosed vertices: the ends of pierced edges whose nearest piercing they lie behind; and from
  /// those of curves that may spread, all that edges without piercings lead to. joined(c, d): vertices of
  /// curves c and d turned out to be the same. No more than `most` are looked for beyond the first.
  template <typename MaySpread, typename Joined>
  void find_enclosed(std::size_t most, const MaySpread& may_spread, const Joined& joined);

  std::span<const Enclosed> enclosed() const { return enclosed_; }
  std::span<const EnclosedTriangle> enclosed_triangles() const { return enclosed_triangles_; }

 private:
  struct PiercedEdge {
    std::uint32_t edge;
    double first, last;               // nearest to the lower and to the upper vertex
    bool lower_inside, upper_inside;  // what those piercings say
    std::uint32_t lower_curve, upper_curve;
  };

  Eigen::Vector3d posed(std::uint32_t vertex) const;
  template <typename Joined>
  void enclose(std::uint32_t vertex, std::uint32_t curve, const Joined& joined);
  void add_enclosed_triangles();

  // An array over a shape's elements of which few are set for each pair.
  struct Slots {
    std::vector<std::uint32_t> stamp, slot;
    std::uint32_t now = 0;

    void start(std::size_t size);
    bool has(std::uint32_t i) const { return stamp[i] == now; }
    void set(std::uint32_t i, std::uint32_t value) { stamp[i] = now, slot[i] = value; }
  };

  const Shape* shape_ = nullptr;
  Pose pose_;
  Eigen::Vector3d center_;
  double reach_ = 0;
  Slots triangle_slots_, edge_slots_, vertex_slots_;
  std::vector<WorldTriangle> triangles_;
  std::vector<PiercedEdge> pierced_;
  std::vector<Enclosed> enclosed_;
  std::vector<EnclosedTriangle> enclosed_triangles_;
};

template <typename Joined>
void BodySide::enclose(std::uint32_t vertex, std::uint32_t curve, const Joined& joined) {
  if (vertex_slots_.has(vertex)) {
    const std::uint32_t other = enclosed_[vertex_slots_.slot[vertex]].curve;
    if (other != curve) joined(other, curve);
    return;
  }
  vertex_slots_.set(vertex, static_cast<std::uint32_t>(enclosed_.size()));
  enclosed_.push_back({vertex, curve, posed(vertex)});
}

template <typename MaySpread, typename Joined>
void BodySide::find_enclosed(std::size_t most, const MaySpread& may_spread, const Joined& joined) {
  const Surface& surface = shape_->surface;
  for (const PiercedEdge& p : pierced_) {
    const Surface::Edge& edge = surface.edge[p.edge];
    if (p.lower_inside) enclose(edge.lower, p.lower_curve, joined);
    if (p.upper_inside) enclose(edge.upper, p.upper_curve, joined);
  }
  for (std::size_t i = 0; i < enclosed_.size() && enclosed_.size() < most; ++i) {
    const auto [vertex, curve] = std::pair(enclosed_[i].vertex, enclosed_[i].curve);
    if (!may_spread(curve)) continue;
    for (const std::uint32_t e : surface.edges_at(vertex)) {
      if (edge_slots_.has(e)) continue;
      const Surface::Edge& edge = surface.edge[e];
      enclose(edge.lower == vertex ? edge.upper : edge.lower, curve, joined);
    }
  }
  add_enclosed_triangles();
}

}  // namespace tandem::simulation
