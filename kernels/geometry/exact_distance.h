#pragma once
#include <cfloat>
#include <cmath>

#include "kernels/geometry/triangle_test.h"
#include "kernels/geometry/wide_number.h"
#include "tandem/kernels/detail/interval.h"

/// The distance of two triangles that do not meet in whole numbers, for any finite corners, on CPU and GPU.
///
/// **Which distances count.** The distance of two triangles, flat or not, that do not meet is that of two
/// points, each in the relative interior of a corner, an edge or the face; as the distance has a minimum
/// there, their difference is normal to both of these. For two corners, nothing more is to be known. For a
/// corner and an edge, the edge has a length, and the corner's foot lies on it. For two edges that are not
/// parallel, and for a corner and a face that is not flat, the feet are the one solution of linear equations.
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

/// out = u . v. term: room.
template <int kW, int kX, int kY>
TANDEM_HD inline void assign_dot(const WideVector<kW, kX>& u, const WideVector<kW, kY>& v,
                                 WideNumber<kW, kX + kY>& out, WideNumber<kW, kX + kY>& term) {
  out.assign_product(u.x[0], v.x[0]);
  for (int k = 1; k < 3; ++k) {
    term.assign_product(u.x[k], v.x[k]);
    out.add(term);
  }
}

/// out = u x v. term: room.
template <int kW, int kX, int kY>
TANDEM_HD inline void assign_cross(const WideVector<kW, kX>& u, const WideVector<kW, kY>& v,
                                   WideVector<kW, kX + kY>& out, WideNumber<kW, kX + kY>& term) {
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    out.x[k].assign_product(u.x[i], v.x[j]);
    term.assign_product(u.x[j], v.x[i]);
    out.x[k].subtract(term);
  }
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

/// The features of two triangles, as many words a coordinate as `range` asks for, at most kWords, with the
/// room that visiting them takes.
template <int kWords>
class Features {
 public:
  template <int kDegree>
  using Number = WideNumber<kWords, kDegree>;
  template <int kDegree>
  using Vector = WideVector<kWords, kDegree>;

  TANDEM_HD void assign(const TrianglePair& t, const detail::ExponentRange& range) {
    const int n = range.words(), unit = range.unit;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        const int next = (i + 1) % 3;
        edge_a_[i].x[k].assign_difference(t.a[next][k], t.a[i][k], unit, n);
        edge_b_[i].x[k].assign_difference(t.b[next][k], t.b[i][k], unit, n);
        for (int j = 0; j < 3; ++j) offset_[i][j].x[k].assign_difference(t.a[i][k], t.b[j][k], unit, n);
      }
    }
  }

  /// Offers the visitor every distance that counts, until it returns true: visit(numerator, denominator,
  /// weights), where the square of the distance is P / 1 given (P, One), P / Q given (P, Q) and V^2 / N given
  /// (V, N).
  template <class Visitor>
  TANDEM_HD bool visit(Visitor& visitor) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (visit_corners(i, j, visitor) || visit_corner_and_edge(i, j, visitor) ||
            visit_edge_and_corner(i, j, visitor) || visit_edges(i, j, visitor))
          return true;
      }
    }
    for (int i = 0; i < 3; ++i) {
      if (visit_face(edge_a_, offset_[0][i], i, true, visitor) ||
          visit_face(edge_b_, offset_[i][0], i, false, visitor))
        return true;
    }
    return false;
  }

 private:
  template <class Visitor>
  TANDEM_HD bool visit_corners(int i, int j, Visitor& visitor) {
    TriangleWeights weights = {};
    weights.a[i] = weights.b[j] = 1;
    assign_dot(offset_[i][j], offset_[i][j], length_, term2_);
    return visitor.corners(length_, weights);
  }

  /// Corner i of a over edge j of b.
  template <class Visitor>
  TANDEM_HD bool visit_corner_and_edge(int i, int j, Visitor& visitor) {
    assign_dot(edge_b_[j], edge_b_[j], length_, term2_);
    assign_dot(edge_b_[j], offset_[i][j], along_, term2_);
    if (length_.sign() == 0 || !is_within(along_, length_)) return false;
    TriangleWeights weights = {};
    weights.a[i] = 1;
    weights.b[(j + 1) % 3] = share(along_, length_);
    weights.b[j] = 1 - weights.b[(j + 1) % 3];
    return visit_height(edge_b_[j], offset_[i][j], weights, visitor);
  }

  /// Edge i of a below corner j of b.
  template <class Visitor>
  TANDEM_HD bool visit_edge_and_corner(int i, int j, Visitor& visitor) {
    assign_dot(edge_a_[i], edge_a_[i], length_, term2_);
    assign_dot(edge_a_[i], offset_[i][j], along_, term2_);
    along_.negate();
    if (length_.sign() == 0 || !is_within(along_, length_)) return false;
    TriangleWeights weights = {};
    weights.b[j] = 1;
    weights.a[(i + 1) % 3] = share(along_, length_);
    weights.a[i] = 1 - weights.a[(i + 1) % 3];
    return visit_height(edge_a_[i], offset_[i][j], weights, visitor);
  }

  /// Visits a corner over an edge whose square is length_.
  template <class Visitor>
  TANDEM_HD bool visit_height(const Vector<1>& edge, const Vector<1>& offset, const TriangleWeights& weights,
                              Visitor& visitor) {
    assign_cross(edge, offset, normal_, term2_);
    assign_dot(normal_, normal_, square_, term4_);
    return visitor.corner_and_edge(square_, length_, weights);
  }

  /// With r the offset, the feet are at s and t along the edges e and f where r + s e - t f is along n = e x
  /// f. Multiplied with n x f and n x e that is s N = -(r x f) . n and t N = (e x r) . n.
  template <class Visitor>
  TANDEM_HD bool visit_edges(int i, int j, Visitor& visitor) {
    if (!make_normal(edge_a_[i], edge_b_[j])) return false;
    assign_along_normal(offset_[i][j], edge_b_[j], s_);
    s_.negate();
    if (!is_within(s_, square_)) return false;
    assign_along_normal(edge_a_[i], offset_[i][j], t_);
    if (!is_within(t_, square_)) return false;
    TriangleWeights weights = {};
    weights.a[(i + 1) % 3] = share(s_, square_);
    weights.a[i] = 1 - weights.a[(i + 1) % 3];
    weights.b[(j + 1) % 3] = share(t_, square_);
    weights.b[j] = 1 - weights.b[(j + 1) % 3];
    assign_dot(offset_[i][j], normal_, volume_, term3_);
    return visitor.on_planes(volume_, square_, weights);
  }

  /// The face with these edges, of which u = edge[0] and -v = edge[2] have its corner 0, and a corner of the
  /// other triangle, whose number is given, at r from there: r = x u + y v + z n, n = u x v, has x N = (r x
  /// v) . n and y N = (u x r) . n. With -v for v, and so -n for n, y N changes its sign; with an offset of -r
  /// for r, which it is where the face is a's, both do.
  template <class Visitor>
  TANDEM_HD bool visit_face(const Vector<1> (&edge)[3], const Vector<1>& offset, int corner, bool face_of_a,
                            Visitor& visitor) {
    if (!make_normal(edge[0], edge[2])) return false;
    assign_along_normal(offset, edge[2], s_);
    assign_along_normal(edge[0], offset, t_);
    (face_of_a ? s_ : t_).negate();
    term4_ = s_;
    term4_.add(t_);
    if (s_.sign() < 0 || t_.sign() < 0 || !is_within(term4_, square_)) return false;
    TriangleWeights weights = {};
    double *face = face_of_a ? weights.a : weights.b, *other = face_of_a ? weights.b : weights.a;
    other[corner] = 1;
    face[1] = share(s_, square_);
    face[2] = share(t_, square_);
    face[0] = 1 - face[1] - face[2] > 0 ? 1 - face[1] - face[2] : 0;
    assign_dot(offset, normal_, volume_, term3_);
    return visitor.on_planes(volume_, square_, weights);
  }

  /// normal_ = u x v and its square. False: they are parallel.
  TANDEM_HD bool make_normal(const Vector<1>& u, const Vector<1>& v) {
    assign_cross(u, v, normal_, term2_);
    assign_dot(normal_, normal_, square_, term4_);
    return square_.sign() != 0;
  }

  /// out = (u x v) . normal_.
  TANDEM_HD void assign_along_normal(const Vector<1>& u, const Vector<1>& v, Number<4>& out) {
    assign_cross(u, v, across_, term2_);
    assign_dot(across_, normal_, out, term4_);
  }

  Vector<1> edge_a_[3], edge_b_[3], offset_[3][3];
  // These are of the feature that is visited.
  Vector<2> normal_, across_;
  Number<2> length_, along_, term2_;
  Number<3> volume_, term3_;
  Number<4> square_, s_, t_, term4_;
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

/// Decides without rounding whether a distance is at most d.
template <int kWords>
class IsWithin {
 public:
  /// The exponents of d are in the range.
  TANDEM_HD void assign(double d, const detail::ExponentRange& range) {
    distance_.assign_difference(d, 0, range.unit, range.words());
    square_.assign_product(distance_, distance_);
  }

  TANDEM_HD bool corners(const WideNumber<kWords, 2>& p, const TriangleWeights&) const {
    return is_within(p, square_);
  }
  TANDEM_HD bool corner_and_edge(const WideNumber<kWords, 4>& p, const WideNumber<kWords, 2>& q,
                                 const TriangleWeights&) {
    bound4_.assign_product(square_, q);
    return is_within(p, bound4_);
  }
  TANDEM_HD bool on_planes(const WideNumber<kWords, 3>& v, const WideNumber<kWords, 4>& n,
                           const TriangleWeights&) {
    square6_.assign_product(v, v);
    bound6_.assign_product(square_, n);
    return is_within(square6_, bound6_);
  }

 private:
  WideNumber<kWords, 1> distance_;
  WideNumber<kWords, 2> square_;
  WideNumber<kWords, 4> bound4_;
  WideNumber<kWords, 6> square6_, bound6_;
};

/// The distance of triangles that do not meet, as NearestFeatures has it, and where it is. Condition:
/// exponents_of(t).words() <= kWords, which holds for all triangles with the most words; fewer take less of
/// the stack.
template <int kWords = detail::kMaxWords>
TANDEM_OUT_OF_LINE TANDEM_HD inline DistanceInterval distance_apart(const TrianglePair& t,
                                                                    TriangleWeights& weights) {
  const detail::ExponentRange range = exponents_of(t);
  NearestFeatures nearest(range.unit);
  Features<kWords> features;
  features.assign(t, range);
  features.visit(nearest);
  weights = nearest.weights();
  return nearest.interval();
}

/// The exponents of all corners and of d: what ClearanceDecision goes by.
TANDEM_HD inline detail::ExponentRange exponents_of(const TrianglePair& t, double d) {
  detail::ExponentRange range = exponents_of(t);
  range.include(d);
  return range;
}

/// Decides clearance in room of its own, which need not be initialised.
template <int kWords>
class ClearanceDecision {
 public:
  /// Returns whether the distance of triangles that do not meet is at most d. Condition: d >= 0, finite;
  /// range: exponents_of() these, of at most kWords words.
  TANDEM_HD bool are_within(const TrianglePair& t, double d, const detail::ExponentRange& range) {
    within_.assign(d, range);
    features_.assign(t, range);
    return features_.visit(within_);
  }

 private:
  IsWithin<kWords> within_;
  Features<kWords> features_;
};

/// Returns whether the distance of triangles that do not meet is at most d. Condition: d >= 0, finite.
TANDEM_OUT_OF_LINE TANDEM_HD inline bool are_within(const TrianglePair& t, double d) {
  ClearanceDecision<detail::kMaxWords> decision;
  return decision.are_within(t, d, exponents_of(t, d));
}

}  // namespace tandem::exact
