// CGAL 5.5 relies on another header for it, which has it no more in Boost 1.90.
#include <boost/next_prior.hpp>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "distance_engine.h"

namespace tandem {
namespace {

using Rounded = CGAL::Exact_predicates_inexact_constructions_kernel;
using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using Triangles = std::vector<Rounded::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Rounded, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Rounded, Primitive>>;
using TriangleBox = CGAL::Box_intersection_d::Box_with_handle_d<double, 3, const Rounded::Triangle_3*>;

Exact::Point_3 exact(const Rounded::Point_3& p) {
  return {p.x(), p.y(), p.z()};
}
Exact::Triangle_3 exact(const Rounded::Triangle_3& t) {
  return {exact(t[0]), exact(t[1]), exact(t[2])};
}

/// Of a level in the world, with the float64 corners that "exact" refers to.
Triangles posed(const AssetView& shape, const Pose& pose) {
  const Pose stored = for_stored_coordinates(pose, shape.header->origin);
  Triangles triangles;
  for (const Triangle& triangle : std::span(shape.level().triangles, shape.level().triangle_count)) {
    Rounded::Point_3 p[3];
    for (int i = 0; i < 3; ++i) {
      const float* v = triangle.corner[i].position;
      double x[3];
      apply(stored, v[0], v[1], v[2], x);
      p[i] = {x[0], x[1], x[2]};
    }
    if (CGAL::collinear(p[0], p[1], p[2]))
      throw std::runtime_error("CGAL has no distances of flat triangles");
    triangles.emplace_back(p[0], p[1], p[2]);
  }
  return triangles;
}

double squared_gap(const CGAL::Bbox_3& box, const Rounded::Point_3& p) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double gap = std::max({box.min(k) - p[k], p[k] - box.max(k), 0.0});
    sum += gap * gap;
  }
  return sum;
}

/// The exact square of a distance that is least, or more: that of a corner of a and the triangle of b that
/// the tree, in float64, takes for the nearest.
Exact::FT bound(const Triangles& a, const Tree& tree) {
  const Rounded::Triangle_3* nearest = nullptr;
  Rounded::Point_3 corner;
  double least = INFINITY;
  for (const Rounded::Triangle_3& triangle : a) {
    for (int i = 0; i < 3; ++i) {
      if (squared_gap(tree.bbox(), triangle[i]) >= least) continue;
      const auto [point, primitive] = tree.closest_point_and_primitive(triangle[i]);
      const double square = CGAL::squared_distance(point, triangle[i]);
      if (square >= least) continue;
      least = square;
      nearest = &*primitive;
      corner = triangle[i];
    }
  }
  return CGAL::squared_distance(exact(corner), exact(*nearest));
}

/// The exact square of the distance of two surfaces: the least of all pairs of triangles with boxes that come
/// within the bound of each other.
Exact::FT squared_distance(const Triangles& a, const Triangles& b) {
  Tree tree(b.begin(), b.end());
  Exact::FT least = bound(a, tree);
  const double reach = std::nextafter(std::sqrt(CGAL::to_interval(least).second), INFINITY);
  std::vector<TriangleBox> boxes_a, boxes_b;
  for (const Rounded::Triangle_3& triangle : b) boxes_b.emplace_back(triangle.bbox(), &triangle);
  for (const Rounded::Triangle_3& triangle : a) {
    const CGAL::Bbox_3 box = triangle.bbox();
    double lower[3], upper[3];
    for (int k = 0; k < 3; ++k) {
      lower[k] = std::nextafter(box.min(k) - reach, -INFINITY);
      upper[k] = std::nextafter(box.max(k) + reach, INFINITY);
    }
    boxes_a.emplace_back(CGAL::Bbox_3(lower[0], lower[1], lower[2], upper[0], upper[1], upper[2]), &triangle);
  }
  CGAL::box_intersection_d(boxes_a.begin(), boxes_a.end(), boxes_b.begin(), boxes_b.end(),
                           [&](const TriangleBox& x, const TriangleBox& y) {
                             const Exact::FT square =
                                 CGAL::squared_distance(exact(*x.handle()), exact(*y.handle()));
                             if (square < least) least = square;
                           });
  return least;
}

/// What the others are held against: the least of the squares of the distances of triangles, in exact
/// arithmetic.
class CgalDistance final : public DistanceEngine {
 public:
  std::string label() const override { return "CGAL"; }
  std::string settings() const override {
    return "AABB_tree for a bound, squared_distance of triangles with exact constructions";
  }
  bool is_reference() const override { return true; }

  void set_shapes(std::span<const AssetView> shapes) override { shapes_ = shapes; }
  void update(std::span<const Instance> bodies) override { bodies_ = bodies; }

  void find(std::span<const ObjectPair> pairs, std::vector<double>& distances) override {
    squares_.clear();
    distances.clear();
    for (const auto& [a, b] : pairs) {
      const Triangles of_a = posed(shapes_[bodies_[a].asset], bodies_[a].pose);
      const Triangles of_b = posed(shapes_[bodies_[b].asset], bodies_[b].pose);
      squares_.push_back(squared_distance(of_a, of_b));
      distances.push_back(std::sqrt(CGAL::to_double(squares_.back())));
    }
  }

  std::uint64_t outside(std::span<const double> lower, std::span<const double> upper) const override {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < squares_.size(); ++i) {
      const Exact::FT least(lower[i]), most(upper[i]);
      if (squares_[i] < least * least || squares_[i] > most * most) ++count;
    }
    return count;
  }

 private:
  std::span<const AssetView> shapes_;
  std::span<const Instance> bodies_;
  std::vector<Exact::FT> squares_;
};

}  // namespace

void add_cgal_distance(std::vector<std::unique_ptr<DistanceEngine>>& engines) {
  engines.push_back(std::make_unique<CgalDistance>());
}

}  // namespace tandem
