#include "triangle_oracle.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Gmpq.h>

#include <algorithm>
#include <array>
#include <variant>

namespace tandem {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Kernel::Point_3;
using Shape = std::variant<Point, Kernel::Segment_3, Kernel::Triangle_3>;

Shape shape(const double (*t)[3]) {
  std::array<Point, 3> p;
  for (int i = 0; i < 3; ++i) p[i] = Point(t[i][0], t[i][1], t[i][2]);
  if (!CGAL::collinear(p[0], p[1], p[2])) return Kernel::Triangle_3(p[0], p[1], p[2]);
  std::sort(p.begin(), p.end(),
            [](const Point& x, const Point& y) { return CGAL::compare_xyz(x, y) == CGAL::SMALLER; });
  if (p[0] == p[2]) return p[0];
  return Kernel::Segment_3(p[0], p[2]);
}

bool meet(const Point& p, const Point& q) {
  return p == q;
}
bool meet(const Point& p, const Kernel::Segment_3& s) {
  return s.has_on(p);
}
bool meet(const Kernel::Segment_3& s, const Point& p) {
  return s.has_on(p);
}
template <class A, class B>
bool meet(const A& a, const B& b) {
  return CGAL::do_intersect(a, b);
}

CGAL::Gmpq rational_volume(const double* p, const double* q, const double* r, const double* s) {
  CGAL::Gmpq d[3][3];
  const double* point[] = {q, r, s};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) d[i][k] = CGAL::Gmpq(point[i][k]) - CGAL::Gmpq(p[k]);
  }
  return d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
         d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
         d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
}

}  // namespace

bool oracle_contact(const TrianglePair& pair) {
  return std::visit([](const auto& a, const auto& b) { return meet(a, b); }, shape(pair.a), shape(pair.b));
}

int oracle_volume_sign(const double* p, const double* q, const double* r, const double* s) {
  return CGAL::sign(rational_volume(p, q, r, s));
}

double oracle_volume_error(const double* p, const double* q, const double* r, const double* s,
                           double computed) {
  return CGAL::to_double(CGAL::abs(CGAL::Gmpq(computed) - rational_volume(p, q, r, s)));
}

double oracle_area_error(const double* p, const double* q, const double* r, int k, double computed) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  const auto minus = [&](const double* x, int axis) { return CGAL::Gmpq(x[axis]) - CGAL::Gmpq(p[axis]); };
  const CGAL::Gmpq area = minus(q, i) * minus(r, j) - minus(q, j) * minus(r, i);
  return CGAL::to_double(CGAL::abs(CGAL::Gmpq(computed) - area));
}

}  // namespace tandem
