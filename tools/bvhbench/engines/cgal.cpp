// CGAL 5.5 relies on another header for it, which has it no more in Boost 1.90.
#include <boost/next_prior.hpp>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Bbox_3.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <variant>

#include "library_engine.h"

namespace tandem {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Constructions = CGAL::Exact_predicates_exact_constructions_kernel;

Kernel::Point_3 point(const double* p) {
  return {p[0], p[1], p[2]};
}
Constructions::Point_3 exact(const Kernel::Point_3& p) {
  return {p.x(), p.y(), p.z()};
}

/// Float64 corners in the world.
PosedTriangle posed(const Pose& stored_pose, const Triangle& triangle) {
  PosedTriangle out;
  for (int i = 0; i < 3; ++i) {
    const float* v = triangle.corner[i].position;
    apply(stored_pose, v[0], v[1], v[2], out.corner[i]);
  }
  return out;
}

/// A posed triangle. `flat`: a segment or a point.
struct ExactTriangle {
  std::uint32_t index;
  bool flat;
  Kernel::Triangle_3 triangle;
};

ExactTriangle exact_triangle(std::uint32_t index, const PosedTriangle& posed) {
  const Kernel::Point_3 p = point(posed.corner[0]), q = point(posed.corner[1]), r = point(posed.corner[2]);
  return {index, CGAL::collinear(p, q, r), Kernel::Triangle_3(p, q, r)};
}

// CGAL's intersection tests refuse flat triangles; these are dispatched as what they are.
namespace flat {

using Point = Constructions::Point_3;
using Segment = Constructions::Segment_3;
using Shape = std::variant<Point, Segment, Constructions::Triangle_3>;

Shape shape(const ExactTriangle& t) {
  Point p[3];
  for (int i = 0; i < 3; ++i) p[i] = exact(t.triangle[i]);
  if (!t.flat) return Constructions::Triangle_3(p[0], p[1], p[2]);
  std::sort(p, p + 3,
            [](const Point& x, const Point& y) { return CGAL::compare_xyz(x, y) == CGAL::SMALLER; });
  if (p[0] == p[2]) return p[0];
  return Segment(p[0], p[2]);
}

bool meet(const Point& p, const Point& q) {
  return p == q;
}
bool meet(const Point& p, const Segment& s) {
  return s.has_on(p);
}
bool meet(const Segment& s, const Point& p) {
  return s.has_on(p);
}
template <class A, class B>
bool meet(const A& a, const B& b) {
  return CGAL::do_intersect(a, b);
}

}  // namespace flat

bool meet(const ExactTriangle& a, const ExactTriangle& b) {
  if (!a.flat && !b.flat) return CGAL::do_intersect(a.triangle, b.triangle);
  return std::visit([](const auto& x, const auto& y) { return flat::meet(x, y); }, flat::shape(a),
                    flat::shape(b));
}

CGAL::Bbox_3 box_of(const PosedTriangle& t) {
  CGAL::Bbox_3 box;
  for (const double* p : t.corner) box += CGAL::Bbox_3(p[0], p[1], p[2], p[0], p[1], p[2]);
  return box;
}

CGAL::Bbox_3 box_of(const LevelView& level, const Pose& pose) {
  CGAL::Bbox_3 box;
  for (std::uint32_t i = 0; i < level.triangle_count; ++i) box += box_of(posed(pose, level.triangles[i]));
  return box;
}

using TriangleBox = CGAL::Box_intersection_d::Box_with_handle_d<double, 3, const ExactTriangle*>;

/// The triangles of an instance that reach into a box, with their own boxes.
struct Reaching {
  std::vector<ExactTriangle> triangles;
  std::vector<TriangleBox> boxes;

  Reaching(const LevelView& level, const Pose& pose, const CGAL::Bbox_3& into) {
    std::vector<CGAL::Bbox_3> bounds;
    for (std::uint32_t i = 0; i < level.triangle_count; ++i) {
      const PosedTriangle triangle = posed(pose, level.triangles[i]);
      const CGAL::Bbox_3 box = box_of(triangle);
      if (!CGAL::do_overlap(box, into)) continue;
      triangles.push_back(exact_triangle(i, triangle));
      bounds.push_back(box);
    }
    for (std::size_t i = 0; i < bounds.size(); ++i) boxes.emplace_back(bounds[i], &triangles[i]);
  }
};

/// The answer that the others are held against: boxes compared in float64, triangles in exact arithmetic.
class CgalContacts final : public EngineWith<LevelView> {
 public:
  using EngineWith::EngineWith;

  std::string label() const override { return "CGAL"; }
  std::string settings() const override {
    return "box_intersection_d over the posed float64 triangles, do_intersect with exact predicates";
  }
  bool is_reference() const override { return true; }

 private:
  void place(std::span<const Pose> poses) override {
    poses_.assign(poses.begin(), poses.end());
    boxes_.clear();
    for (std::uint32_t i = 0; i < poses_.size(); ++i) boxes_.push_back(box_of(shape(i), poses_[i]));
  }

  void collide(std::uint32_t pair, std::uint32_t a, std::uint32_t b) override {
    if (!CGAL::do_overlap(boxes_[a], boxes_[b])) return;
    Reaching of_a(shape(a), poses_[a], boxes_[b]);
    Reaching of_b(shape(b), poses_[b], boxes_[a]);
    const auto decide = [&](const TriangleBox& box_a, const TriangleBox& box_b) {
      ++candidates_;
      if (!meet(*box_a.handle(), *box_b.handle())) return;
      add_contact(pair, box_a.handle()->index, box_b.handle()->index);
    };
    CGAL::box_intersection_d(of_a.boxes.begin(), of_a.boxes.end(), of_b.boxes.begin(), of_b.boxes.end(),
                             decide);
  }

  std::vector<Pose> poses_;
  std::vector<CGAL::Bbox_3> boxes_;
};

using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
using BoxOfTriangle = CGAL::Box_intersection_d::Box_with_handle_d<double, 3, const Kernel::Triangle_3*>;

Constructions::Triangle_3 exact(const Kernel::Triangle_3& t) {
  return {exact(t[0]), exact(t[1]), exact(t[2])};
}

/// The triangles of a level in the world, with the float64 corners that "exact" refers to.
Triangles posed(const Pose& stored_pose, const LevelView& level) {
  Triangles triangles;
  for (std::uint32_t i = 0; i < level.triangle_count; ++i) {
    const ExactTriangle triangle = exact_triangle(i, posed(stored_pose, level.triangles[i]));
    if (triangle.flat) throw std::runtime_error("CGAL has no distances of flat triangles");
    triangles.push_back(triangle.triangle);
  }
  return triangles;
}

double squared_gap(const CGAL::Bbox_3& box, const Kernel::Point_3& p) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double gap = std::max({box.min(k) - p[k], p[k] - box.max(k), 0.0});
    sum += gap * gap;
  }
  return sum;
}

/// The exact square of a distance that is least, or more: that of a corner of a and the triangle of b that
/// the tree, in float64, takes for the nearest.
Constructions::FT bound(const Triangles& a, const Tree& tree) {
  const Kernel::Triangle_3* nearest = nullptr;
  Kernel::Point_3 corner;
  double least = INFINITY;
  for (const Kernel::Triangle_3& triangle : a) {
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
Constructions::FT squared_distance(const Triangles& a, const Triangles& b) {
  Tree tree(b.begin(), b.end());
  Constructions::FT least = bound(a, tree);
  const double reach = std::nextafter(std::sqrt(CGAL::to_interval(least).second), INFINITY);
  std::vector<BoxOfTriangle> boxes_a, boxes_b;
  for (const Kernel::Triangle_3& triangle : b) boxes_b.emplace_back(triangle.bbox(), &triangle);
  for (const Kernel::Triangle_3& triangle : a) {
    const CGAL::Bbox_3 box = triangle.bbox();
    double lower[3], upper[3];
    for (int k = 0; k < 3; ++k) {
      lower[k] = std::nextafter(box.min(k) - reach, -INFINITY);
      upper[k] = std::nextafter(box.max(k) + reach, INFINITY);
    }
    boxes_a.emplace_back(CGAL::Bbox_3(lower[0], lower[1], lower[2], upper[0], upper[1], upper[2]), &triangle);
  }
  CGAL::box_intersection_d(boxes_a.begin(), boxes_a.end(), boxes_b.begin(), boxes_b.end(),
                           [&](const BoxOfTriangle& x, const BoxOfTriangle& y) {
                             const Constructions::FT square =
                                 CGAL::squared_distance(exact(*x.handle()), exact(*y.handle()));
                             if (square < least) least = square;
                           });
  return least;
}

/// Finds what other distances are held against: the least of the squares of the distances of triangles, in
/// exact arithmetic.
class CgalDistances final : public EngineWith<LevelView> {
 public:
  using EngineWith::EngineWith;

  std::string label() const override { return "CGAL"; }
  std::string settings() const override {
    return "AABB_tree for a bound, squared_distance of triangles with exact constructions";
  }
  bool is_reference() const override { return true; }

  void find_distances(std::span<const ObjectPair> pairs, std::vector<double>& distances) override {
    squares_.clear();
    LibraryEngine::find_distances(pairs, distances);
  }

  std::uint64_t outside(std::span<const double> lower, std::span<const double> upper) const override {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < squares_.size(); ++i) {
      const Constructions::FT least(lower[i]), most(upper[i]);
      if (squares_[i] < least * least || squares_[i] > most * most) ++count;
    }
    return count;
  }

 private:
  void place(std::span<const Pose> poses) override { poses_.assign(poses.begin(), poses.end()); }

  double distance(std::uint32_t a, std::uint32_t b) override {
    squares_.push_back(squared_distance(triangles_of(a), triangles_of(b)));
    return std::sqrt(CGAL::to_double(squares_.back()));
  }

  Triangles triangles_of(std::uint32_t body) const { return posed(poses_[body], shape(body)); }

  std::vector<Pose> poses_;
  std::vector<Constructions::FT> squares_;
};

}  // namespace

std::unique_ptr<Engine> make_cgal(std::string_view name, const Question& question) {
  if (std::holds_alternative<DistanceOptions>(question)) return std::make_unique<CgalDistances>(name);
  return std::make_unique<CgalContacts>(name);
}

}  // namespace tandem
