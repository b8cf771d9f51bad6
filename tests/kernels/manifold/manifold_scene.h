#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "kernels/asked.h"
#include "kernels/query_scenes.h"
#include "kernels/solid_meshes.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/detail/vector3.h"
#include "tandem/kernels/manifold_query.h"

/// Bodies, and the contact manifolds between them.
namespace tandem::test {

using manifold::Vector3;

inline constexpr double kDegree = 3.14159265358979323846 / 180;

inline double angle_between(const Vector3& p, const Vector3& q) {
  return std::atan2(norm(cross(p, q)), dot(p, q));
}

inline Vector3 vector_of(const double (&x)[3]) {
  return {x[0], x[1], x[2]};
}

inline Vector3 apply(const Pose& pose, const Vector3& x) {
  double out[3];
  tandem::apply(pose, x.x, x.y, x.z, out);
  return {out[0], out[1], out[2]};
}

inline Vector3 rotate(const Pose& pose, const Vector3& x) {
  return apply(pose, x) - apply(pose, {});
}

/// First `inner`, then `outer`.
inline Pose after(const Pose& outer, const Pose& inner) {
  Pose out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) out.rotation[i][j] += outer.rotation[i][k] * inner.rotation[k][j];
    }
  }
  tandem::apply(outer, inner.translation[0], inner.translation[1], inner.translation[2], out.translation);
  return out;
}

inline Pose shift(double x, double y, double z) {
  Pose pose = kIdentityPose;
  pose.translation[0] = x, pose.translation[1] = y, pose.translation[2] = z;
  return pose;
}

/// About axis 0, 1 or 2.
inline Pose turn(int axis, double angle) {
  Pose pose = kIdentityPose;
  const int i = (axis + 1) % 3, j = (axis + 2) % 3;
  pose.rotation[i][i] = pose.rotation[j][j] = std::cos(angle);
  pose.rotation[j][i] = std::sin(angle);
  pose.rotation[i][j] = -std::sin(angle);
  return pose;
}

inline Pose any_motion(RandomPoses& random, double reach) {
  return random.pose({.translation = reach});
}

template <typename Element>
bool same_bytes(std::span<const Element> x, std::span<const Element> y) {
  return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size_bytes()) == 0);
}

class ManifoldScene {
 public:
  std::uint32_t add_shape(const Mesh& mesh, const std::array<double, 3>& origin = {}) {
    assets.add(mesh, origin);
    return assets.size() - 1;
  }
  void add_body(std::uint32_t shape, const Pose& pose) { bodies.push_back({shape, pose}); }

  /// Finds the manifolds of all bodies, moved by `motion` first.
  void find(const Pose& motion = kIdentityPose, const ManifoldOptions& options = {.match_previous = false}) {
    if (named_shapes_ != assets.size()) {
      ASSERT_EQ(scene.set_assets(assets.views()), Status::kOk);
      named_shapes_ = assets.size();
    }
    posed.clear();
    for (const Instance& body : bodies) posed.push_back({body.asset, after(motion, body.pose)});
    ASSERT_EQ(scene.place(posed), Status::kOk);
    ASSERT_EQ(query.find(scene), Status::kOk);
    ASSERT_EQ(made.find(scene, query, options), Status::kOk);
  }

  std::span<const Manifold> manifolds() const { return made.rows(); }
  std::span<const ManifoldPoint> points() const { return made.points(); }
  std::span<const ManifoldPoint> points_of(const Manifold& m) const {
    return made.points().subspan(m.first_point, m.point_count);
  }

  SampleAssets assets;
  std::vector<Instance> bodies, posed;
  Scene scene;
  ContactQuery query;
  ManifoldQuery made;

 private:
  std::uint32_t named_shapes_ = 0;
};

using Triangles = std::vector<std::array<Vector3, 3>>;

inline Triangles triangles_of(const Mesh& mesh, const Pose& pose) {
  Triangles out;
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](int k) {
      const auto& p = mesh.points[t[static_cast<std::size_t>(k)]];
      return apply(pose, Vector3{p[0], p[1], p[2]});
    };
    out.push_back({corner(0), corner(1), corner(2)});
  }
  return out;
}

/// Returns how far a point is from a surface, or from the planes and edges of its nearest triangle.
inline double off_surface(const Triangles& surface, const Vector3& x) {
  double out = INFINITY;
  for (const auto& [p, q, r] : surface) {
    const Vector3 n = normalized(cross(q - p, r - p));
    double outside = 0;
    for (int k = 0; k < 3; ++k) {
      const Vector3 &from = k == 0 ? p : k == 1 ? q : r, &to = k == 0 ? q : k == 1 ? r : p;
      outside = std::max(outside, dot(normalized(cross(to - from, n)), x - from));
    }
    out = std::min(out, std::max(std::fabs(dot(n, x - p)), outside));
  }
  return out;
}

/// A part of a surface: its area vector, and the sum of area vectors times middles.
struct SurfacePart {
  Vector3 area;
  Vector3 moment[3];  // moment[k]: of coordinate k

  /// The middle of the part, as seen along a unit vector.
  Vector3 middle(const Vector3& n) const {
    return (1 / dot(area, n)) * Vector3{dot(moment[0], n), dot(moment[1], n), dot(moment[2], n)};
  }
};

/// The part of a surface that lies inside a convex body, by cutting every triangle with every face.
inline SurfacePart surface_inside(const Triangles& surface, const Triangles& convex) {
  SurfacePart part;
  for (const auto& triangle : surface) {
    std::vector<Vector3> polygon(triangle.begin(), triangle.end()), next;
    for (const auto& face : convex) {
      if (polygon.empty()) break;
      const Vector3 n = cross(face[1] - face[0], face[2] - face[0]);
      next.clear();
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vector3 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        const double at_p = dot(n, p - face[0]), at_q = dot(n, q - face[0]);
        if (at_p <= 0) next.push_back(p);
        if ((at_p < 0 && at_q > 0) || (at_p > 0 && at_q < 0))
          next.push_back(p + (at_p / (at_p - at_q)) * (q - p));
      }
      polygon.swap(next);
    }
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      const Vector3 area = 0.5 * cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
      const Vector3 middle = (1.0 / 3) * (polygon[0] + polygon[i - 1] + polygon[i]);
      part.area = part.area + area;
      part.moment[0] = part.moment[0] + middle.x * area;
      part.moment[1] = part.moment[1] + middle.y * area;
      part.moment[2] = part.moment[2] + middle.z * area;
    }
  }
  return part;
}

/// How far a surface reaches along a direction.
inline double reach_along(const Triangles& surface, const Vector3& n) {
  double most = -INFINITY;
  for (const auto& triangle : surface) {
    for (const Vector3& x : triangle) most = std::max(most, dot(n, x));
  }
  return most;
}

}  // namespace tandem::test
