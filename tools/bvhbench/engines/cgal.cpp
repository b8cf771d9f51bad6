// CGAL 5.5 relies on another header for it, which has it no more in Boost 1.90.
#include <boost/next_prior.hpp>

#include <CGAL/Bbox_3.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <variant>

#include "library_engine.h"

namespace tandem {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

/// A posed triangle. `flat`: a segment or a point.
struct ExactTriangle {
  std::uint32_t index;
  bool flat;
  Kernel::Triangle_3 triangle;
};

ExactTriangle exact_triangle(std::uint32_t index, const PosedTriangle& posed) {
  const auto point = [&](int i) {
    return Kernel::Point_3(posed.corner[i][0], posed.corner[i][1], posed.corner[i][2]);
  };
  const Kernel::Point_3 p = point(0), q = point(1), r = point(2);
  return {index, CGAL::collinear(p, q, r), Kernel::Triangle_3(p, q, r)};
}

// CGAL's intersection tests refuse flat triangles; these are dispatched as what they are.
namespace flat {

using Constructions = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Constructions::Point_3;
using Segment = Constructions::Segment_3;
using Shape = std::variant<Point, Segment, Constructions::Triangle_3>;

Shape shape(const ExactTriangle& t) {
  Point p[3];
  for (int i = 0; i < 3; ++i) {
    const Kernel::Point_3& corner = t.triangle[i];
    p[i] = Point(corner.x(), corner.y(), corner.z());
  }
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

PosedTriangle posed(const Pose& stored_pose, const Triangle& triangle) {
  PosedTriangle out;
  for (int i = 0; i < 3; ++i) {
    const float* v = triangle.corner[i].position;
    apply(stored_pose, v[0], v[1], v[2], out.corner[i]);
  }
  return out;
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
class CgalEngine final : public LibraryEngine {
 public:
  std::string_view name() const override { return "cgal"; }
  std::string label() const override { return "CGAL"; }
  std::string settings() const override {
    return "box_intersection_d over the posed float64 triangles, do_intersect with exact predicates";
  }
  bool is_reference() const override { return true; }

 private:
  void clear_shapes() override { levels_.clear(); }
  void add_shape(const LevelView& level) override { levels_.push_back(level); }

  void place(std::span<const Pose> poses) override {
    poses_.assign(poses.begin(), poses.end());
    boxes_.clear();
    for (std::size_t i = 0; i < poses_.size(); ++i) boxes_.push_back(box_of(level_of(i), poses_[i]));
  }

  void collide(std::uint32_t pair, std::uint32_t a, std::uint32_t b) override {
    Reaching of_a(level_of(a), poses_[a], boxes_[b]);
    Reaching of_b(level_of(b), poses_[b], boxes_[a]);
    const auto decide = [&](const TriangleBox& box_a, const TriangleBox& box_b) {
      ++candidates_;
      if (!meet(*box_a.handle(), *box_b.handle())) return;
      add_contact(pair, box_a.handle()->index, box_b.handle()->index);
    };
    CGAL::box_intersection_d(of_a.boxes.begin(), of_a.boxes.end(), of_b.boxes.begin(), of_b.boxes.end(),
                             decide);
  }

  const LevelView& level_of(std::size_t body) const { return levels_[shape_of()[body]]; }

  std::vector<LevelView> levels_;
  std::vector<Pose> poses_;
  std::vector<CGAL::Bbox_3> boxes_;
};

}  // namespace

std::unique_ptr<Engine> make_cgal(const ContactOptions&) {
  return std::make_unique<CgalEngine>();
}

}  // namespace tandem
