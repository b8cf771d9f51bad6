#include "triangle_oracle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

#include "kernels/rational.h"

namespace tandem {
namespace {

using Kernel = ExactKernel;
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

/// det(q - p, r - p, s - p).
Rational rational_volume(const double* p, const double* q, const double* r, const double* s) {
  const RationalPoint from = rational(p);
  return dot(rational(q) - from, cross(rational(r) - from, rational(s) - from));
}

Rational clamped(const Rational& x) {
  return x < 0 ? Rational(0) : x > 1 ? Rational(1) : x;
}

/// |x|, rounded.
double size_of(const Rational& x) {
  return CGAL::to_double(x < 0 ? Rational(-x) : x);
}

/// The square of the distance of a point and a segment that starts at the origin.
Rational point_segment(const RationalPoint& p, const RationalPoint& e) {
  const Rational square = dot(e, e);
  const RationalPoint apart = square == 0 ? p : p - clamped(dot(p, e) / square) * e;
  return dot(apart, apart);
}

/// The square of the distance of two segments by the sides of the square of parameters and its inside.
Rational segments(const RationalPoint& p, const RationalPoint& e, const RationalPoint& q,
                  const RationalPoint& f) {
  Rational least = std::min(std::min(point_segment(p - q, f), point_segment(p + e - q, f)),
                            std::min(point_segment(q - p, e), point_segment(q + f - p, e)));
  const Rational ee = dot(e, e), ff = dot(f, f), ef = dot(e, f);
  const Rational determinant = ee * ff - ef * ef;
  if (determinant == 0) return least;
  const RationalPoint r = p - q;
  const Rational s = (ef * dot(f, r) - ff * dot(e, r)) / determinant,
                 t = (ee * dot(f, r) - ef * dot(e, r)) / determinant;
  if (s < 0 || s > 1 || t < 0 || t > 1) return least;
  const RationalPoint apart = r + s * e - t * f;
  return std::min(least, dot(apart, apart));
}

/// The square of the distance of a point and the plane of a triangle, where the foot is on the triangle, by
/// the normal equations; else `least`.
Rational point_face(const RationalPoint& p, const std::array<RationalPoint, 3>& t, const Rational& least) {
  const RationalPoint u = t[1] - t[0], v = t[2] - t[0], r = p - t[0];
  const Rational uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), determinant = uu * vv - uv * uv;
  if (determinant == 0) return least;
  const Rational x = (vv * dot(u, r) - uv * dot(v, r)) / determinant,
                 y = (uu * dot(v, r) - uv * dot(u, r)) / determinant;
  if (x < 0 || y < 0 || x + y > 1) return least;
  const RationalPoint apart = r - x * u - y * v;
  return std::min(least, dot(apart, apart));
}

Rational squared_distance(const TrianglePair& pair) {
  std::array<RationalPoint, 3> a, b;
  for (int i = 0; i < 3; ++i) {
    a[i] = rational(pair.a[i]);
    b[i] = rational(pair.b[i]);
  }
  Rational least = dot(a[0] - b[0], a[0] - b[0]);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      least = std::min(least, segments(a[i], a[(i + 1) % 3] - a[i], b[j], b[(j + 1) % 3] - b[j]));
  }
  for (int i = 0; i < 3; ++i) least = point_face(a[i], b, point_face(b[i], a, least));
  return least;
}

}  // namespace

struct DistanceOracle::Square {
  Rational value;
};

DistanceOracle::DistanceOracle(const TrianglePair& pair)
    : square_(new Square{oracle_contact(pair) ? Rational(0) : squared_distance(pair)}) {}
DistanceOracle::~DistanceOracle() = default;

bool DistanceOracle::meet() const {
  return square_->value == 0;
}

bool DistanceOracle::is_in(double lower, double upper) const {
  const auto square = [](double x) { return Rational(x) * Rational(x); };
  return square(lower) <= square_->value && (std::isinf(upper) || square_->value <= square(upper));
}

double DistanceOracle::rounded() const {
  return std::sqrt(CGAL::to_double(square_->value));
}

int oracle_share() {
  return kOracleShare;
}

bool oracle_contact(const TrianglePair& pair) {
  return std::visit([](const auto& a, const auto& b) { return meet(a, b); }, shape(pair.a), shape(pair.b));
}

int oracle_volume_sign(const double* p, const double* q, const double* r, const double* s) {
  return CGAL::sign(rational_volume(p, q, r, s));
}

double oracle_volume_error(const double* p, const double* q, const double* r, const double* s,
                           double computed) {
  return size_of(Rational(computed) - rational_volume(p, q, r, s));
}

double oracle_area_error(const double* p, const double* q, const double* r, int k, double computed) {
  const RationalPoint from = rational(p);
  const Rational area = cross(rational(q) - from, rational(r) - from)[static_cast<std::size_t>(k)];
  return size_of(Rational(computed) - area);
}

}  // namespace tandem
