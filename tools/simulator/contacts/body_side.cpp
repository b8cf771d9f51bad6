#include "body_side.h"

#include <Eigen/Geometry>
#include <cmath>

namespace tandem::simulation {

using Eigen::Vector3d;

void BodySide::Slots::start(std::size_t size) {
  if (stamp.size() < size) stamp.resize(size, 0), slot.resize(size);
  if (++now == 0) {  // once in 2^32 pairs
    std::fill(stamp.begin(), stamp.end(), 0);
    now = 1;
  }
}

void BodySide::start(const Shape& shape, const Pose& pose) {
  shape_ = &shape;
  pose_ = for_stored_coordinates(pose, shape.origin);
  apply(pose_, shape.center.x(), shape.center.y(), shape.center.z(), center_.data());
  reach_ = center_.cwiseAbs().maxCoeff() + shape.diagonal / 2;
  triangle_slots_.start(shape.surface.triangle_count());
  edge_slots_.start(shape.surface.edge.size());
  vertex_slots_.start(shape.surface.vertex_count());
  triangles_.clear();
  pierced_.clear();
  enclosed_.clear();
  enclosed_triangles_.clear();
}

Vector3d BodySide::posed(std::uint32_t vertex) const {
  const auto& p = shape_->surface.position[vertex];
  Vector3d out;
  apply(pose_, p[0], p[1], p[2], out.data());
  return out;
}

std::uint32_t BodySide::triangle(std::uint32_t index) {
  if (triangle_slots_.has(index)) return triangle_slots_.slot[index];
  const auto slot = static_cast<std::uint32_t>(triangles_.size());
  triangle_slots_.set(index, slot);
  WorldTriangle& out = triangles_.emplace_back();
  const auto& corner = shape_->level.triangles[index].corner;
  for (int k = 0; k < 3; ++k) {
    const float* p = corner[k].position;
    apply(pose_, p[0], p[1], p[2], out.corner[k].data());
  }
  const Vector3d normal = (out.corner[1] - out.corner[0]).cross(out.corner[2] - out.corner[0]);
  const double length = normal.norm();
  const double scale = length > 1e-290 ? (shape_->surface.turned[index] != 0 ? -1 : 1) / length : 0;
  out.normal = scale * normal;
  return slot;
}

void BodySide::add_piercing(std::uint32_t edge, double at, bool lower_inside, std::uint32_t curve) {
  if (!edge_slots_.has(edge)) {
    edge_slots_.set(edge, static_cast<std::uint32_t>(pierced_.size()));
    pierced_.push_back({edge, at, at, lower_inside, !lower_inside, curve, curve});
    return;
  }
  PiercedEdge& p = pierced_[edge_slots_.slot[edge]];
  if (at < p.first) p.first = at, p.lower_inside = lower_inside, p.lower_curve = curve;
  if (at > p.last) p.last = at, p.upper_inside = !lower_inside, p.upper_curve = curve;
}

// Those around enclosed vertices that no curve cuts; each is met three times and taken at its largest vertex.
void BodySide::add_enclosed_triangles() {
  const Surface& surface = shape_->surface;
  for (const Enclosed& v : enclosed_) {
    for (const std::uint32_t t : surface.around(v.vertex)) {
      const auto& corner = surface.corner[t];
      if (v.vertex < corner[0] || v.vertex < corner[1] || v.vertex < corner[2]) continue;
      if (triangle_slots_.has(t)) continue;
      bool all = true;
      for (const std::uint32_t c : corner) all = all && vertex_slots_.has(c);
      if (!all) continue;
      enclosed_triangles_.push_back(
          {{vertex_slots_.slot[corner[0]], vertex_slots_.slot[corner[1]], vertex_slots_.slot[corner[2]]},
           v.curve,
           surface.turned[t] != 0});
    }
  }
}

}  // namespace tandem::simulation
