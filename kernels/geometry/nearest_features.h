#pragma once
#include <type_traits>

#include "kernels/geometry/frame_test.h"

/// The nearest points of the features of two triangles, as computed: a guess that nothing depends on. What is
/// certified is made of it afterwards, by bounds that hold for any guess. For CPU and GPU.
///
/// Templates over Value: float, double, or a vector with a pair in each lane, see frame_test.h.
namespace tandem::distance {

using frame::Flag;
using frame::larger;
using frame::less;
using frame::magnitude;
using frame::Point;
using frame::select;

// frame_test.h has these for float.
TANDEM_HD inline Flag less(double x, double y) {
  return {x < y};
}
TANDEM_HD inline double select(Flag mask, double x, double y) {
  return mask ? x : y;
}

/// A number as Value has it; Value{} is 0 in every lane.
template <typename Value>
TANDEM_HD inline Value value_of(double x) {
  if constexpr (std::is_floating_point_v<Value>)
    return static_cast<Value>(x);
  else
    return Value{} + static_cast<float>(x);
}

template <typename Value>
TANDEM_HD inline Value dot(const Point<Value>& u, const Point<Value>& v) {
  return (u.x[0] * v.x[0] + u.x[1] * v.x[1]) + u.x[2] * v.x[2];
}

template <typename Value>
TANDEM_HD inline Point<Value> cross(const Point<Value>& u, const Point<Value>& v) {
  return {{u.x[1] * v.x[2] - u.x[2] * v.x[1], u.x[2] * v.x[0] - u.x[0] * v.x[2],
           u.x[0] * v.x[1] - u.x[1] * v.x[0]}};
}

template <typename Value>
TANDEM_HD inline Point<Value> minus(const Point<Value>& u, const Point<Value>& v) {
  return {{u.x[0] - v.x[0], u.x[1] - v.x[1], u.x[2] - v.x[2]}};
}

template <typename Value>
TANDEM_HD inline Point<Value> plus(const Point<Value>& u, const Point<Value>& v) {
  return {{u.x[0] + v.x[0], u.x[1] + v.x[1], u.x[2] + v.x[2]}};
}

template <typename Value>
TANDEM_HD inline Point<Value> scaled(const Value& factor, const Point<Value>& u) {
  return {{factor * u.x[0], factor * u.x[1], factor * u.x[2]}};
}

template <typename Value>
TANDEM_HD inline Value clamped_to_1(const Value& x) {
  const Value zero{}, one = value_of<Value>(1);
  const Value above = select(less(zero, x), x, zero);
  return select(less(above, one), above, one);
}

/// 1 / x; 0 where x is not at least `least`, a positive number so large that nothing overflows.
template <typename Value>
TANDEM_HD inline Value inverse(const Value& x, const Value& least) {
  const auto defined = less(least, x);
  return select(defined, value_of<Value>(1) / select(defined, x, value_of<Value>(1)), Value{});
}

/// The place where two triangles are nearest. Features 0 to 8 are edge i of a and edge j of b, 3 i + j, with
/// the points corner + s edge and corner + t edge; 9 to 11 are a's face and corner j of b; 12 to 14 are b's
/// face and corner i of a, with the point at corner 0 + s (corner 1 - corner 0) + t (corner 2 - corner 0) of
/// the face.
template <typename Value>
struct Nearest {
  Value square;        ///< of the distance
  Point<Value> apart;  ///< the point of a less the point of b
  Point<Value>
      along;  ///< the same, or where a face is nearest its normal on this side: better where both are near
  Value feature, s, t;

  template <typename Mask>
  TANDEM_HD void take(Mask where, const Value& square_there, const Point<Value>& apart_there,
                      const Point<Value>& along_there, int number, const Value& s_there,
                      const Value& t_there) {
    const auto better = less(square_there, square) & where;
    square = select(better, square_there, square);
    for (int k = 0; k < 3; ++k) {
      apart.x[k] = select(better, apart_there.x[k], apart.x[k]);
      along.x[k] = select(better, along_there.x[k], along.x[k]);
    }
    feature = select(better, value_of<Value>(number), feature);
    s = select(better, s_there, s);
    t = select(better, t_there, t);
  }
};

/// The numbers of an edge.
template <typename Value>
struct Edge {
  Point<Value> along;
  Value square, inverse_square;
};

/// Two edges' nearest points; `offset` is from b's corner to a's. Source: Ericson 2005, section 5.1.9, with
/// the first parameter worked out again from the second.
template <typename Value>
TANDEM_HD inline void take_edges(const Edge<Value>& e, const Edge<Value>& f, const Point<Value>& offset,
                                 int number, const Value& least, Nearest<Value>& nearest) {
  const Value ef = dot(e.along, f.along), er = dot(e.along, offset), fr = dot(f.along, offset);
  const Value s_free = (ef * fr - er * f.square) * inverse(e.square * f.square - ef * ef, least * least);
  const Value t = clamped_to_1((ef * clamped_to_1(s_free) + fr) * f.inverse_square);
  const Value s = clamped_to_1((ef * t - er) * e.inverse_square);
  const Point<Value> apart = minus(plus(offset, scaled(s, e.along)), scaled(t, f.along));
  const Value square = dot(apart, apart);
  nearest.take(!less(square, Value{}), square, apart, apart, number, s, t);
}

/// A face's three corners and some corners of the other triangle; `sign` is 1 where the face is a's. The
/// square is that of the two points, and not of the height, which means nothing where the face is a needle.
template <int kCorners, typename Value>
TANDEM_HD inline void take_face(const Point<Value> (&face)[3], const Point<Value> (&corner)[kCorners],
                                float sign, int number, const Value& least, Nearest<Value>& nearest) {
  const Point<Value> u = minus(face[1], face[0]), v = minus(face[2], face[0]), normal = cross(u, v);
  const Value inverse_square = inverse(dot(normal, normal), least * least);
  const Point<Value> to_s = scaled(inverse_square, cross(v, normal)),
                     to_t = scaled(inverse_square, cross(normal, u));
  const Value zero{}, one = value_of<Value>(1);
  const auto has_normal = less(zero, inverse_square);
  for (int i = 0; i < kCorners; ++i) {
    const Point<Value> r = minus(corner[i], face[0]);
    const Value s = dot(r, to_s), t = dot(r, to_t), height = dot(r, normal);
    const Value part = height * inverse_square;
    const auto above = has_normal & !(less(s, zero) | less(t, zero) | less(one, s + t));
    const Point<Value> to_face = minus(plus(scaled(s, u), scaled(t, v)), r);
    const Point<Value> apart = scaled(value_of<Value>(sign), to_face);
    nearest.take(above, dot(apart, apart), apart, scaled(value_of<Value>(-sign) * part, normal), number + i,
                 s, t);
  }
}

/// least: the square of a length below which an edge counts as a point; its square is a normal number.
template <typename Value>
TANDEM_HD inline Nearest<Value> nearest_features(const Point<Value> (&a)[3], const Point<Value> (&b)[3],
                                                 const Value& least) {
  Edge<Value> of_a[3], of_b[3];
  for (int i = 0; i < 3; ++i) {
    of_a[i].along = minus(a[(i + 1) % 3], a[i]);
    of_b[i].along = minus(b[(i + 1) % 3], b[i]);
    of_a[i].square = dot(of_a[i].along, of_a[i].along);
    of_b[i].square = dot(of_b[i].along, of_b[i].along);
    of_a[i].inverse_square = inverse(of_a[i].square, least);
    of_b[i].inverse_square = inverse(of_b[i].square, least);
  }
  const Value zero{};
  Nearest<Value> nearest;
  nearest.apart = nearest.along = minus(a[0], b[0]);
  nearest.square = dot(nearest.apart, nearest.apart);
  nearest.feature = nearest.s = nearest.t = zero;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) take_edges(of_a[i], of_b[j], minus(a[i], b[j]), 3 * i + j, least, nearest);
  }
  take_face(a, b, 1, 9, least, nearest);
  take_face(b, a, -1, 12, least, nearest);
  return nearest;
}

/// The point of a triangle that is nearest to the origin, as that of two triangles the second of which is the
/// origin three times. The first point, not the second, tells s. least: as above.
template <typename Value>
TANDEM_HD inline Nearest<Value> nearest_to_origin(const Point<Value> (&a)[3], const Value& least) {
  const Value zero{};
  Nearest<Value> nearest;
  nearest.apart = nearest.along = a[0];
  nearest.square = dot(a[0], a[0]);
  nearest.feature = nearest.s = nearest.t = zero;
  for (int i = 0; i < 3; ++i) {
    const Point<Value> along = minus(a[(i + 1) % 3], a[i]);
    const Value s = clamped_to_1((zero - dot(along, a[i])) * inverse(dot(along, along), least));
    const Point<Value> apart = plus(a[i], scaled(s, along));
    const Value square = dot(apart, apart);
    nearest.take(!less(square, zero), square, apart, apart, 3 * i, s, zero);
  }
  const Point<Value> origin[1] = {{{zero, zero, zero}}};
  take_face(a, origin, 1, 9, least, nearest);
  return nearest;
}

}  // namespace tandem::distance
