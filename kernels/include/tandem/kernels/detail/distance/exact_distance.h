#pragma once
#include <cfloat>
#include <cmath>

#include "tandem/kernels/detail/distance/interval.h"
#include "tandem/kernels/detail/distance/wide_number.h"
#include "tandem/kernels/detail/triangle_test.h"

/// The distance of two triangles that do not meet in whole numbers, for any finite corners, on CPU and GPU.
///
/// **Which distances count.** The distance of two triangles, flat or not, that do not meet is that of two
/// points, each in the relative interior of a corner, an edge or the face; as the distance has a minimum
/// there, their difference is normal to both of these. Of two corners, nothing more is to be known. Of a
/// corner and an edge, the edge has a length, and the corner's foot lies on it. Of two edges that are not
/// parallel, and of a corner and a face that is not flat, the feet are the one solution of linear equations.
/// What is left is spared: from a pair of nearest points on parallel edges, on an edge and a parallel face,
/// or on two parallel faces, both points can move alike, at the same distance, until one of them comes to the
/// end of its feature. (A flat face is a union of its edges.) So the least of the distances of corners, and
/// of those feet that lie on their closed features, is the distance: each is that of two points of the
/// triangles, and one of them is the smallest.
///
/// Squares of these distances are quotients of polynomials in the differences of corners: P, of degree 2, for
/// corners; P / Q, of degrees 4 and 2, for a corner and an edge; V^2 / N, of degrees 6 and 4, for the others,
/// N being the square of a normal n and V the part of an offset along it.
namespace tandem::exact {

template <int kWords, int kDegree>
struct WideVector {
  WideNumber<kWords, kDegree> x[3];
};

template <int kW, int kX, int kY>
TANDEM_HD inline WideNumber<kW, kX + kY> dot(const WideVector<kW, kX>& u, const WideVector<kW, kY>& v) {
  return u.x[0] * v.x[0] + u.x[1] * v.x[1] + u.x[2] * v.x[2];
}

template <int kW, int kX, int kY>
TANDEM_HD inline WideVector<kW, kX + kY> cross(const WideVector<kW, kX>& u, const WideVector<kW, kY>& v) {
  WideVector<kW, kX + kY> out;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    out.x[k] = u.x[i] * v.x[j] - u.x[j] * v.x[i];
  }
  return out;
}

template <int kW, int kD>
TANDEM_HD inline WideVector<kW, kD> operator-(const WideVector<kW, kD>& u) {
  WideVector<kW, kD> out;
  for (int k = 0; k < 3; ++k) out.x[k] = -u.x[k];
  return out;
}

/// 0 <= x <= y.
template <int kW, int kD>
TANDEM_HD inline bool is_within(const WideNumber<kW, kD>& x, const WideNumber<kW, kD>& y) {
  return x.sign() >= 0 && WideNumber<kW, kD>::compare_magnitudes(x, y) <= 0;
}

/// x / y as a float64 in [0, 1]. Condition: 0 <= x <= y, y > 0.
template <int kW, int kD>
TANDEM_HD inline double share(const WideNumber<kW, kD>& x, const WideNumber<kW, kD>& y) {
  if (x.sign() == 0) return 0;
  const Scaled of_x = scaled(x), of_y = scaled(y);
  const double quotient = std::ldexp(of_x.lower / of_y.lower, of_x.exponent - of_y.exponent);
  return quotient < 1 ? quotient : 1;
}

/// The exponents of all corners.
TANDEM_HD inline detail::ExponentRange exponents_of(const TrianglePair& t) {
  detail::ExponentRange range;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      range.include(t.a[i][k]);
      range.include(t.b[i][k]);
    }
  }
  return range;
}

/// The features of two triangles, as many words a coordinate as `range` asks for, at most kWords.
template <int kWords>
class Features {
 public:
  template <int kDegree>
  using Number = WideNumber<kWords, kDegree>;
  template <int kDegree>
  using Vector = WideVector<kWords, kDegree>;

  TANDEM_HD Features(const TrianglePair& t, const detail::ExponentRange& range) {
    const int n = range.words(), unit = range.unit;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        const int next = (i + 1) % 3;
        edge_a_[i].x[k] = Number<1>::difference(t.a[next][k], t.a[i][k], unit, n);
        edge_b_[i].x[k] = Number<1>::difference(t.b[next][k], t.b[i][k], unit, n);
        for (int j = 0; j < 3; ++j) offset_[i][j].x[k] = Number<1>::difference(t.a[i][k], t.b[j][k], unit, n);
      }
    }
  }

  /// Offers the visitor every distance that counts, until it returns true: visit(numerator, denominator,
  /// weights), where the square of the distance is P / 1 given (P, One), P / Q given (P, Q) and V^2 / N given
  /// (V, N).
  template <class Visitor>
  TANDEM_HD bool visit(Visitor& visitor) const {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (visit_corners(i, j, visitor) || visit_corner_and_edge(i, j, visitor) ||
            visit_edge_and_corner(i, j, visitor) || visit_edges(i, j, visitor))
          return true;
      }
    }
    const Vector<1> a[2] = {edge_a_[0], -edge_a_[2]}, b[2] = {edge_b_[0], -edge_b_[2]};
    for (int i = 0; i < 3; ++i) {
      if (visit_face(a, -offset_[0][i], i, true, visitor) || visit_face(b, offset_[i][0], i, false, visitor))
        return true;
    }
    return false;
  }

 private:
  template <class Visitor>
  TANDEM_HD bool visit_corners(int i, int j, Visitor& visitor) const {
    TriangleWeights weights = {};
    weights.a[i] = weights.b[j] = 1;
    return visitor.corners(dot(offset_[i][j], offset_[i][j]), weights);
  }

  /// Corner i of a over edge j of b.
  template <class Visitor>
  TANDEM_HD bool visit_corner_and_edge(int i, int j, Visitor& visitor) const {
    const auto length = dot(edge_b_[j], edge_b_[j]), along = dot(edge_b_[j], offset_[i][j]);
    if (length.sign() == 0 || !is_within(along, length)) return false;
    TriangleWeights weights = {};
    weights.a[i] = 1;
    weights.b[(j + 1) % 3] = share(along, length);
    weights.b[j] = 1 - weights.b[(j + 1) % 3];
    const auto normal = cross(edge_b_[j], offset_[i][j]);
    return visitor.corner_and_edge(dot(normal, normal), length, weights);
  }

  /// Edge i of a below corner j of b.
  template <class Visitor>
  TANDEM_HD bool visit_edge_and_corner(int i, int j, Visitor& visitor) const {
    const auto length = dot(edge_a_[i], edge_a_[i]), along = -dot(edge_a_[i], offset_[i][j]);
    if (length.sign() == 0 || !is_within(along, length)) return false;
    TriangleWeights weights = {};
    weights.b[j] = 1;
    weights.a[(i + 1) % 3] = share(along, length);
    weights.a[i] = 1 - weights.a[(i + 1) % 3];
    const auto normal = cross(edge_a_[i], offset_[i][j]);
    return visitor.corner_and_edge(dot(normal, normal), length, weights);
  }

  /// With r the offset, the feet are at s and t along the edges e and f where r + s e - t f is along n = e x
  /// f. Multiplied with n x f and n x e that is s N = -(r x f) . n and t N = (e x r) . n.
  template <class Visitor>
  TANDEM_HD bool visit_edges(int i, int j, Visitor& visitor) const {
    const auto normal = cross(edge_a_[i], edge_b_[j]);
    const auto square = dot(normal, normal);
    if (square.sign() == 0) return false;
    const auto s = -dot(cross(offset_[i][j], edge_b_[j]), normal);
    if (!is_within(s, square)) return false;
    const auto t = dot(cross(edge_a_[i], offset_[i][j]), normal);
    if (!is_within(t, square)) return false;
    TriangleWeights weights = {};
    weights.a[(i + 1) % 3] = share(s, square);
    weights.a[i] = 1 - weights.a[(i + 1) % 3];
    weights.b[(j + 1) % 3] = share(t, square);
    weights.b[j] = 1 - weights.b[(j + 1) % 3];
    return visitor.on_planes(dot(offset_[i][j], normal), square, weights);
  }

  /// The face with these two edges from its corner 0, and a corner of the other triangle, whose number is
  /// given, at r from there: r = x u + y v + z n has x N = (r x v) . n and y N = (u x r) . n.
  template <class Visitor>
  TANDEM_HD bool visit_face(const Vector<1> (&edge)[2], const Vector<1>& r, int corner, bool face_of_a,
                            Visitor& visitor) const {
    const auto normal = cross(edge[0], edge[1]);
    const auto square = dot(normal, normal);
    if (square.sign() == 0) return false;
    const auto x = dot(cross(r, edge[1]), normal), y = dot(cross(edge[0], r), normal);
    if (x.sign() < 0 || y.sign() < 0 || !is_within(x + y, square)) return false;
    TriangleWeights weights = {};
    double *face = face_of_a ? weights.a : weights.b, *other = face_of_a ? weights.b : weights.a;
    other[corner] = 1;
    face[1] = share(x, square);
    face[2] = share(y, square);
    face[0] = 1 - face[1] - face[2] > 0 ? 1 - face[1] - face[2] : 0;
    return visitor.on_planes(dot(r, normal), square, weights);
  }

  Vector<1> edge_a_[3], edge_b_[3], offset_[3][3];
};

/// Keeps the least distance, as an interval whose ends differ by less than 2^-49 of it, or by less than two
/// of the least float64 numbers.
class NearestFeatures {
 public:
  TANDEM_HD explicit NearestFeatures(int unit) : unit_(unit) {}

  template <class Square>
  TANDEM_HD bool corners(const Square& p, const TriangleWeights& weights) {
    return offer(scaled(p), {1, 1, 0}, weights);
  }
  template <class Numerator, class Denominator>
  TANDEM_HD bool corner_and_edge(const Numerator& p, const Denominator& q, const TriangleWeights& weights) {
    return offer(scaled(p), scaled(q), weights);
  }
  template <class Volume, class Square>
  TANDEM_HD bool on_planes(const Volume& v, const Square& n, const TriangleWeights& weights) {
    const Scaled of = scaled(v);
    return offer({of.lower * of.lower, of.upper * of.upper, 2 * of.exponent}, scaled(n), weights);
  }

  TANDEM_HD const DistanceInterval& interval() const { return least_; }
  TANDEM_HD const TriangleWeights& weights() const { return weights_; }

 private:
  /// The square of the distance is p / q. Numerators that are squares pass one rounding, quotients and roots
  /// another each, of which the root halves what came before: less than 2.1 u, and four are spared, u being
  /// 2^-53. Numbers below the normal range are rounded once more, by half of the least.
  TANDEM_HD bool offer(const Scaled& p, const Scaled& q, const TriangleWeights& weights) {
    constexpr double kSpare = 4 * 0x1p-53, kSmall = 0x1p-1000, kLeast = 0x1p-1074;
    const int exponent = (p.exponent - q.exponent) / 2 + unit_;
    double lower = std::ldexp(std::sqrt(p.lower / q.upper) * (1 - kSpare), exponent);
    double upper = std::ldexp(std::sqrt(p.upper / q.lower) * (1 + kSpare), exponent);
    if (lower < kSmall) lower = lower > kLeast ? lower - kLeast : 0;
    if (upper < kSmall) upper += kLeast;
    if (lower > DBL_MAX) lower = DBL_MAX;
    if (lower < least_.lower) least_.lower = lower;
    if (upper < least_.upper) {
      least_.upper = upper;
      weights_ = weights;
    }
    return false;
  }

  DistanceInterval least_ = {INFINITY, INFINITY};
  TriangleWeights weights_ = {};
  int unit_;
};

/// Whether a distance is at most d, decided without rounding.
template <int kWords>
class IsWithin {
 public:
  /// The exponents of d are in the range.
  TANDEM_HD IsWithin(double d, const detail::ExponentRange& range)
      : distance_(WideNumber<kWords, 1>::difference(d, 0, range.unit, range.words())),
        square_(distance_ * distance_) {}

  TANDEM_HD bool corners(const WideNumber<kWords, 2>& p, const TriangleWeights&) const {
    return is_within(p, square_);
  }
  TANDEM_HD bool corner_and_edge(const WideNumber<kWords, 4>& p, const WideNumber<kWords, 2>& q,
                                 const TriangleWeights&) const {
    return is_within(p, square_ * q);
  }
  TANDEM_HD bool on_planes(const WideNumber<kWords, 3>& v, const WideNumber<kWords, 4>& n,
                           const TriangleWeights&) const {
    return is_within(v * v, square_ * n);
  }

 private:
  WideNumber<kWords, 1> distance_;
  WideNumber<kWords, 2> square_;
};

/// The distance of triangles that do not meet, as NearestFeatures has it, and where it is. Condition:
/// exponents_of(t).words() <= kWords, which holds for all triangles with the most words; fewer take less of
/// the stack.
template <int kWords = detail::kMaxWords>
TANDEM_OUT_OF_LINE TANDEM_HD inline DistanceInterval distance_apart(const TrianglePair& t,
                                                                    TriangleWeights& weights) {
  const detail::ExponentRange range = exponents_of(t);
  NearestFeatures nearest(range.unit);
  Features<kWords>(t, range).visit(nearest);
  weights = nearest.weights();
  return nearest.interval();
}

/// Whether the distance of triangles that do not meet is at most d. Condition: d >= 0, finite.
TANDEM_OUT_OF_LINE TANDEM_HD inline bool are_within(const TrianglePair& t, double d) {
  detail::ExponentRange range = exponents_of(t);
  range.include(d);
  IsWithin<detail::kMaxWords> within(d, range);
  return Features<detail::kMaxWords>(t, range).visit(within);
}

}  // namespace tandem::exact
