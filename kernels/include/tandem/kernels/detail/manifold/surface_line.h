#pragma once
#include <cstdint>

#include "tandem/kernels/detail/manifold/body.h"

/// Questions to the tree of a posed body: where a line meets its surface, and which of its vertices reaches
/// furthest. Boxes are tested in float32 with slack; triangles and vertices decide in float64. So the answers
/// do not depend on which blocks are walked, nor in which order.
namespace tandem::manifold {

/// Float32 rounds coordinates, products and sums to 2^-24 of |box| + |point|; a dozen of them amount to less
/// than this part. The tolerance of triangles, 10^-12, is far below.
inline constexpr float kBoxSlack = 0x1p-18f;

/// The plane of a patch and the lines across it.
struct PatchFrame {
  Vector3 origin, u, v, n;

  PatchFrame() = default;
  TANDEM_HD PatchFrame(const Vector3& at, const Vector3& normal)
      : origin(at), u(unit_orthogonal(normal)), v(cross(normal, u)), n(normal) {}

  TANDEM_HD Vector2 flat(const Vector3& x) const {
    const Vector3 d = x - origin;
    return {dot(u, d), dot(v, d)};
  }
  TANDEM_HD double height(const Vector3& x) const { return dot(n, x - origin); }
  TANDEM_HD Vector3 at(const Vector2& x, double h) const { return origin + x.x * u + x.y * v + h * n; }
};

struct FloatVector {
  float x[3];
};

TANDEM_HD inline float dot(const FloatVector& p, const FloatVector& q) {
  return p.x[0] * q.x[0] + p.x[1] * q.x[1] + p.x[2] * q.x[2];
}

/// A direction of the world along the axes of the mesh.
TANDEM_HD inline FloatVector in_mesh(const Body& body, const Vector3& direction) {
  FloatVector out{};
  for (int k = 0; k < 3; ++k) {
    const auto& r = body.pose.rotation;
    out.x[k] = static_cast<float>(r[0][k] * direction.x + r[1][k] * direction.y + r[2][k] * direction.z);
  }
  return out;
}

/// A point of the world in stored coordinates.
TANDEM_HD inline FloatVector point_in_mesh(const Body& body, const Vector3& point) {
  const double* t = body.pose.translation;
  return in_mesh(body, point - Vector3{t[0], t[1], t[2]});
}

/// How much float32 may be off for boxes of this body near a point of stored coordinates.
TANDEM_HD inline float slack_near(const Body& body, const FloatVector& point) {
  const Shape& shape = *body.shape;
  const double far = std::fabs(shape.center.x) + std::fabs(shape.center.y) + std::fabs(shape.center.z) +
                     shape.diagonal + std::fabs(point.x[0]) + std::fabs(point.x[1]) + std::fabs(point.x[2]);
  return static_cast<float>(far) * kBoxSlack + static_cast<float>(body.reach) * 0x1p-42f;
}

/// The axes of a block's frame, as rows, along those of the mesh.
struct BlockAxes {
  FloatVector axis[3];

  TANDEM_HD explicit BlockAxes(const BlockRotation& rotation) {
    const ScaledRotation r = scaled_rotation(rotation);
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < 3; ++i) axis[k].x[i] = r.scaled[i][k] / r.squared_length;
    }
  }
  TANDEM_HD FloatVector operator()(const FloatVector& p) const {
    return {{dot(axis[0], p), dot(axis[1], p), dot(axis[2], p)}};
  }
};

/// Visits the triangles of a body whose boxes pass the test. Test: passes(center, half_extent) of a box, and
/// turned(axes), the same test for boxes along these axes. Imaginary boxes pass no test that compares with
/// <=.
template <typename Test, typename Visit>
TANDEM_HD inline void walk_surface(const Body& body, const Test& test, const Visit& visit) {
  const Shape& shape = *body.shape;
  std::uint32_t stack[3 * kMaxDepth + 2];
  int waiting = 0;
  stack[waiting++] = 0;
  while (waiting > 0) {
    const std::uint32_t index = stack[--waiting];
    if (shape.blocks != nullptr) {
      const Block& block = shape.blocks[index];
      for (int i = kNodesPerBlock - 1; i >= 0; --i) {
        const FloatVector center = {{block.center[0][i], block.center[1][i], block.center[2][i]}};
        const FloatVector half = {
            {block.half_extent[0][i], block.half_extent[1][i], block.half_extent[2][i]}};
        if (!test.passes(center, half)) continue;
        if (block.kind[i] == NodeKind::leaf) {
          visit(block.index[i]);
        } else if (block.kind[i] == NodeKind::internal) {
          stack[waiting++] = block.index[i];
        }
      }
    } else {
      const OrientedBlock& block = shape.oriented_blocks[index];
      const auto turned = test.turned(BlockAxes(block.rotation));
      for (int i = kNodesPerBlock - 1; i >= 0; --i) {
        const FloatVector center = {{block.center[0][i], block.center[1][i], block.center[2][i]}};
        const FloatVector half = {
            {block.half_extent[0][i], block.half_extent[1][i], block.half_extent[2][i]}};
        if (!turned.passes(center, half)) continue;
        const std::uint32_t below =
            (block.first_below & ~OrientedBlock::kIsLeafBlock) + static_cast<std::uint32_t>(i);
        if (block.is_leaf_block()) {
          visit(below);
        } else {
          stack[waiting++] = below;
        }
      }
    }
  }
}

/// Where a line along a patch's normal meets a surface.
struct Crossing {
  double height = 0;
  std::uint32_t triangle = kNoIndex;

  TANDEM_HD bool found() const { return triangle != kNoIndex; }
};

/// Triangles that the normal grazes at less than this sine are walls, which have no height.
inline constexpr double kWall = 0.01;

/// Boxes that the line meets, no further from the target along it than `reach`, and with heights above it
/// between `lower` and `upper`.
struct LineTest {
  FloatVector point, direction;  // at the target's height
  float lower, upper, slack;
  const float* reach;

  TANDEM_HD LineTest turned(const BlockAxes& axes) const {
    return {axes(point), axes(direction), lower, upper, slack, reach};
  }
  TANDEM_HD bool passes(const FloatVector& c, const FloatVector& h) const {
    const float x = c.x[0] - point.x[0], y = c.x[1] - point.x[1], z = c.x[2] - point.x[2];
    const float p = direction.x[0], q = direction.x[1], r = direction.x[2];
    const float ap = std::fabs(p), aq = std::fabs(q), ar = std::fabs(r);
    if (!(std::fabs(y * r - z * q) <= h.x[1] * ar + h.x[2] * aq + slack)) return false;
    if (!(std::fabs(z * p - x * r) <= h.x[2] * ap + h.x[0] * ar + slack)) return false;
    if (!(std::fabs(x * q - y * p) <= h.x[0] * aq + h.x[1] * ap + slack)) return false;
    const float along = x * p + y * q + z * r, extent = h.x[0] * ap + h.x[1] * aq + h.x[2] * ar + slack;
    return std::fabs(along) - extent <= *reach && along + extent >= lower && along - extent <= upper;
  }
};

/// The crossing of the line through `at` that is nearest in height to `target`, between lower and upper and
/// no further away than `most`, of triangles whose outward normals point along the frame's (facing 1) or
/// against it
/// (-1). Of two as near the triangle that comes first. Where none is that near, `most` becomes the distance
/// of another, or infinite.
TANDEM_HD inline Crossing crossing_within(const Body& body, const PatchFrame& frame, const Vector2& at,
                                          int facing, double target, double lower, double upper,
                                          double& most) {
  Crossing best;
  double nearest = INFINITY;
  const FloatVector point = point_in_mesh(body, frame.at(at, target));
  const float slack = slack_near(body, point);
  float reach = static_cast<float>(most) + slack;
  const LineTest test = {point,
                         in_mesh(body, frame.n),
                         static_cast<float>(lower - target) - slack,
                         static_cast<float>(upper - target) + slack,
                         slack,
                         &reach};
  const double rounding = 0x1p-48 * body.reach;
  walk_surface(body, test, [&](std::uint32_t t) {
    Vector3 corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = body.corner(t, k) - frame.origin;
    const Vector3 normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    const double area = dot(frame.n, normal);
    const bool turned = is_turned(body.shape->topology[t].flags);
    const double size = norm(normal);
    if ((area > 0) != ((facing > 0) != turned) || !(std::fabs(area) > kWall * size)) return;
    Vector2 side[3];
    for (int k = 0; k < 3; ++k) side[k] = Vector2{dot(frame.u, corner[k]), dot(frame.v, corner[k])} - at;
    // Shares of the corners. What lies on an edge, or beside it by no more than rounding of posed points and
    // a little of the triangle, belongs to both triangles: no line slips through.
    const double p = cross(side[1], side[2]) / area, q = cross(side[2], side[0]) / area,
                 r = cross(side[0], side[1]) / area;
    const double little = 1e-9 + rounding * std::sqrt(size) / std::fabs(area);
    if (!(p >= -little && q >= -little && r >= -little)) return;
    const double height =
        p * dot(frame.n, corner[0]) + q * dot(frame.n, corner[1]) + r * dot(frame.n, corner[2]);
    if (!(height >= lower && height <= upper)) return;
    const double distance = std::fabs(height - target);
    if (distance > nearest || (distance == nearest && t >= best.triangle)) return;
    nearest = distance;
    best = {height, t};
    const float as_far = static_cast<float>(distance) + slack;
    reach = as_far < reach ? as_far : reach;
  });
  // What is further away than `most` need not be the nearest: not all boxes there were looked at.
  const bool is_nearest = nearest <= most;
  most = nearest;
  return is_nearest ? best : Crossing{};
}

/// The same however far away it is. expected: how far it is, mostly.
TANDEM_HD inline Crossing nearest_crossing(const Body& body, const PatchFrame& frame, const Vector2& at,
                                           int facing, double target, double expected) {
  double most = expected;
  const Crossing near = crossing_within(body, frame, at, facing, target, -INFINITY, INFINITY, most);
  return near.found() ? near : crossing_within(body, frame, at, facing, target, -INFINITY, INFINITY, most);
}

/// The part of space across a convex polygon in a patch's plane, between two heights.
struct Prism {
  static constexpr int kMostSides = 8;

  PatchFrame frame;
  Vector2 outward[kMostSides];  // unit normals of the sides
  double offset[kMostSides];    // inside: outward * x <= offset
  int sides = 0;
  double lower, upper;

  TANDEM_HD bool contains(const Vector2& x) const {
    bool inside = true;
    for (int i = 0; i < sides; ++i) inside = inside && dot(outward[i], x) <= offset[i];
    return inside;
  }
};

/// Boxes that reach into a prism and further along a direction than what is known.
struct PrismTest {
  FloatVector side[Prism::kMostSides], direction, origin;
  float offset[Prism::kMostSides];
  int sides;
  float least_below, most_below;  // heights along the direction that may count
  float slack;
  const float* furthest;

  TANDEM_HD PrismTest turned(const BlockAxes& axes) const {
    PrismTest out = *this;
    for (int i = 0; i < sides; ++i) out.side[i] = axes(side[i]);
    out.direction = axes(direction);
    out.origin = axes(origin);
    return out;
  }
  TANDEM_HD bool passes(const FloatVector& c, const FloatVector& h) const {
    const FloatVector d = {{c.x[0] - origin.x[0], c.x[1] - origin.x[1], c.x[2] - origin.x[2]}};
    const auto extent = [&](const FloatVector& e) {
      return std::fabs(e.x[0]) * h.x[0] + std::fabs(e.x[1]) * h.x[1] + std::fabs(e.x[2]) * h.x[2] + slack;
    };
    const float along = dot(direction, d), reach = extent(direction);
    if (!(along + reach >= *furthest && along - reach <= most_below && along + reach >= least_below))
      return false;
    for (int i = 0; i < sides; ++i) {
      if (!(dot(side[i], d) - extent(side[i]) <= offset[i])) return false;
    }
    return true;
  }
};

/// A vertex of a triangle.
struct Extreme {
  Vector2 at;
  double height = 0;
  std::uint32_t vertex = kNoIndex;

  TANDEM_HD bool found() const { return vertex != kNoIndex; }
};

/// The highest (upwards 1) or lowest (-1) vertex of a body in a prism. Of several the one of the least
/// number.
TANDEM_HD inline Extreme extreme_vertex(const Body& body, const Prism& prism, int upwards) {
  const PatchFrame& frame = prism.frame;
  Extreme best;
  double furthest = -INFINITY;
  float reached = -INFINITY;
  PrismTest test;
  test.origin = point_in_mesh(body, frame.origin);
  test.slack = slack_near(body, test.origin);
  test.direction = in_mesh(body, static_cast<double>(upwards) * frame.n);
  test.sides = prism.sides;
  for (int i = 0; i < prism.sides; ++i) {
    test.side[i] = in_mesh(body, prism.outward[i].x * frame.u + prism.outward[i].y * frame.v);
    test.offset[i] = static_cast<float>(prism.offset[i]) + test.slack;
  }
  test.least_below = static_cast<float>(upwards > 0 ? prism.lower : -prism.upper) - test.slack;
  test.most_below = static_cast<float>(upwards > 0 ? prism.upper : -prism.lower) + test.slack;
  test.furthest = &reached;
  walk_surface(body, test, [&](std::uint32_t t) {
    const TriangleTopology& topology = body.shape->topology[t];
    for (int k = 0; k < 3; ++k) {
      const Vector3 x = body.corner(t, k);
      const double height = frame.height(x), along = upwards * height;
      const std::uint32_t vertex = topology.vertex[k];
      if (!(along >= furthest) || (along == furthest && vertex >= best.vertex)) continue;
      if (!(height >= prism.lower && height <= prism.upper)) continue;
      const Vector2 at = frame.flat(x);
      if (!prism.contains(at)) continue;
      furthest = along;
      best = {at, height, vertex};
      reached = static_cast<float>(along) - test.slack;
    }
  });
  return best;
}

}  // namespace tandem::manifold
