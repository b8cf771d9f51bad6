#pragma once
#include <cmath>

#include "kernels/geometry/box_test.h"
#include "kernels/geometry/relative_pose.h"

/// The first stage of the triangle test: float32 in the frame of the first instance, with an error bound, for
/// CPU and GPU. Decides nearly all candidates of ordinary scenes; right whenever it decides.
///
/// Templates over Value: float, or a vector with a candidate in each lane, which has the same operators; the
/// results are the same, bit by bit. A vector type brings, in its own namespace, select(mask, x, y),
/// larger(x, y), magnitude(x), less(x, y), whose results combine by & | ^ !, and any() of these.
///
/// **Proof.** Let X be the posed float64 points that a query is about, and T(X) = n (X - t_a), n being the
/// float64 inverse of a's rotation that relative_pose() works with. T is affine and det n > 0 for rigid
/// poses, so a volume of posed points has the sign of the volume of their images. The slack along a's axes,
/// 1.001 (s_i + epsilon_i + 4.1 u tau_i) + 2^-88 in docs/box_test.md, has s_i, which bounds how far the image
/// of a corner of a is from the corner as stored, plus how far that of one of b is from posed exactly by what
/// float32 keeps of the pose; epsilon_i, which bounds how far box_terms::posed_centre() is from that; and a
/// part for boxes alone. Let E be the largest of the three without that part, with 1.001 and 2^-88 to spare.
///
/// Let u = 2^-24 and ~ mark what is computed. A difference x~ of two corners of one mesh is off by at most e
/// = 2E + u m, where m is at least its magnitude; of corners of different meshes by E + u |x~|. A normal, n~
/// = u~ x v~, of differences bounded by m: each component is off by at most 2 (2 m e + e^2) for its factors
/// and 4 u m^2 (1 + u) for its rounding; nu = 4 m (e + u m) + 2 e^2. The volume, a product w~ . n~ with a
/// difference of corners of different meshes, is then off by at most
///
///     sum |n~_k| (E + u |w~_k|) + nu sum (|w~_k| + E + u |w~_k|) + ((1 + u)^3 - 1) sum |n~_k| |w~_k|
///       <= E |n~|_1 + nu (|w~|_1 + 3 E) (1 + u) + 4 u (1 + 2 u) sum |n~_k w~_k|.
///
/// The bound as computed makes up for its own at most 20 roundings, and the factors 1 + 2 u, by 1.001.
/// Underflow, flushed to zero or not, costs at most 2^-126 an operation. Coordinates, translations and slack
/// are at most 2^30 (frame_error()), so differences are below 2^32, and three of them in a normal, seven in a
/// volume and eleven in its bound come to less than 2^-88; the bound has 2^-80 to spare for that. Nothing
/// overflows: a volume is below 6 * 2^96.
namespace tandem {

/// The largest coordinate, distance and slack that this stage takes.
inline constexpr double kLargestInFrame = 0x1p30;

/// E of the proof; infinite where the proof's conditions do not hold: then the stage decides nothing.
TANDEM_HD inline float frame_error(const RelativePose& b_in_a, const TreeExtent& tree_a,
                                   const TreeExtent& tree_b) {
  double error = 0, largest = 0;
  for (int k = 0; k < 3; ++k) {
    double of_boxes = tree_a.half_extent[k];  // tau of the proof
    for (int j = 0; j < 3; ++j) {
      of_boxes += static_cast<double>(b_in_a.abs_rotation[k][j]) *
                  (tree_b.half_extent[j] + static_cast<double>(b_in_a.slack_b[j]));
    }
    const double slack = static_cast<double>(b_in_a.slack_a[k]);
    error = std::fmax(error, slack - 4.09 * relative_pose_detail::kU * of_boxes);
    largest = std::fmax(largest, std::fmax(tree_a.reach[k], tree_b.reach[k]));
    largest = std::fmax(largest, std::fabs(static_cast<double>(b_in_a.translation[k])));
  }
  // Images of b's corners reach as far as 2^0.8 reach_b + translation.
  if (!(largest <= kLargestInFrame / 4 && error <= kLargestInFrame / 4)) return INFINITY;
  return static_cast<float>(error * (1 + 0x1p-20));
}

namespace frame {

/// A bool whose & | ^ are those of a mask of lanes.
struct Flag {
  bool set;

  TANDEM_HD operator bool() const { return set; }
  TANDEM_HD friend Flag operator&(Flag a, Flag b) { return {static_cast<bool>(a.set & b.set)}; }
  TANDEM_HD friend Flag operator|(Flag a, Flag b) { return {static_cast<bool>(a.set | b.set)}; }
  TANDEM_HD friend Flag operator^(Flag a, Flag b) { return {a.set != b.set}; }
  TANDEM_HD friend Flag operator!(Flag a) { return {!a.set}; }
};

TANDEM_HD inline Flag less(float x, float y) {
  return {x < y};
}
TANDEM_HD inline float magnitude(float x) {
  return std::fabs(x);
}
TANDEM_HD inline float larger(float x, float y) {
#ifdef __CUDA_ARCH__
  return fmaxf(x, y);  // one instruction; of NaN nothing is decided either way
#else
  return x < y ? y : x;
#endif
}
TANDEM_HD inline float select(Flag mask, float x, float y) {
  return mask ? x : y;
}
TANDEM_HD inline bool any(Flag mask) {
  return mask.set;
}

/// A point for each lane.
template <typename Value>
struct Point {
  Value x[3];
};

/// The image in a's frame of a point of b as stored.
template <typename Value>
TANDEM_HD inline Point<Value> posed(const RelativePose& b_in_a, const Point<Value>& stored) {
  return {{box_terms::posed_centre(b_in_a, 0, stored.x), box_terms::posed_centre(b_in_a, 1, stored.x),
           box_terms::posed_centre(b_in_a, 2, stored.x)}};
}

template <typename Value, typename Mask>
TANDEM_HD inline Point<Value> select_point(Mask mask, const Point<Value>& p, const Point<Value>& q) {
  return {{select(mask, p.x[0], q.x[0]), select(mask, p.x[1], q.x[1]), select(mask, p.x[2], q.x[2])}};
}

template <typename Value>
TANDEM_HD inline Point<Value> difference(const Point<Value>& p, const Point<Value>& q) {
  return {{p.x[0] - q.x[0], p.x[1] - q.x[1], p.x[2] - q.x[2]}};
}

template <typename Value>
TANDEM_HD inline Value sum_of_magnitudes(const Value (&x)[3]) {
  return (magnitude(x[0]) + magnitude(x[1])) + magnitude(x[2]);
}

template <typename Value>
TANDEM_HD inline Value largest_magnitude(const Value (&x)[3]) {
  return larger(larger(magnitude(x[0]), magnitude(x[1])), magnitude(x[2]));
}

/// A volume and the bound of its error.
template <typename Value>
struct Volume {
  Value value, bound;
};

/// A plane through three corners. Without kBounded, volumes come without bounds: taken as computed.
template <typename Value, bool kBounded>
struct Plane {
  Point<Value> origin;
  Value normal[3];
  Value normal_size;   ///< E |n|_1 of the proof
  Value normal_error;  ///< nu of the proof

  TANDEM_HD Plane(const Point<Value>& p, const Point<Value>& q, const Point<Value>& r, float error)
      : origin(p) {
    const Point<Value> u = difference(q, p), v = difference(r, p);
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      normal[k] = u.x[i] * v.x[j] - u.x[j] * v.x[i];
    }
    if constexpr (!kBounded) return;
    constexpr float kU = 0x1p-24f;
    const Value m = larger(largest_magnitude(u.x), largest_magnitude(v.x));
    const Value e = kU * m + 2 * error;
    normal_size = error * sum_of_magnitudes(normal);
    normal_error = 4 * (m * (kU * m + e)) + 2 * (e * e);
  }

  /// volume(p, q, r, s), s being a corner of another mesh than p.
  TANDEM_HD Volume<Value> volume(const Point<Value>& s, float error) const {
    const Point<Value> w = difference(s, origin);
    const Value term[3] = {w.x[0] * normal[0], w.x[1] * normal[1], w.x[2] * normal[2]};
    const Value value = (term[0] + term[1]) + term[2];
    if constexpr (!kBounded) return {value, Value{}};
    constexpr float kU = 0x1p-24f, kUnderflow = 0x1p-80f;
    const Value far = sum_of_magnitudes(w.x) + 3 * error;
    const Value bound = (normal_size + normal_error * far) + 4 * kU * sum_of_magnitudes(term);
    return {value, 1.001f * bound + kUnderflow};
  }
};

/// A box for each lane, in a's frame.
template <typename Value>
struct BoxInFrame {
  Value centre[3], half_extent[3];
};

/// The box in a's frame around the image of a box of b as stored.
template <typename Value>
TANDEM_HD inline BoxInFrame<Value> posed(const RelativePose& b_in_a, const BoxInFrame<Value>& stored) {
  BoxInFrame<Value> out;
  for (int k = 0; k < 3; ++k) {
    out.centre[k] = box_terms::posed_centre(b_in_a, k, stored.centre);
    out.half_extent[k] = box_terms::b_on_face(b_in_a, k, stored.half_extent);
  }
  return out;
}

/// Returns whether boxes lie strictly on one side of a plane, with all corners of triangles within them: then
/// none of these triangles meets the one that the plane was made of. The boxes hold stored corners of a,
/// where the plane is b's, or are posed() and hold images of b's corners, where it is a's.
///
/// **Proof.** The volume of a corner in a box, whose centre is at w, is off by at most what the proof above
/// says of a difference bounded by |w| + h; that of the centre is computed, and the box reaches sum |n_k| h_k
/// from it. The box of an image has errors of its own: its centre is off by the epsilon_i that E has, its
/// half-extents are rounded up by abs_rotation, and underflow in either, at most six operations a coordinate,
/// moves an end of it by less than 2^-122. That counts as an error of the corner's coordinate, so by |n|_1
/// times as much, and the 2^-88 that E has to spare, which the bound multiplies with |n|_1 too, is more.
template <typename Value>
TANDEM_HD inline auto beyond(const Plane<Value, true>& plane, const BoxInFrame<Value>& box, float error) {
  const auto &centre = box.centre, &half_extent = box.half_extent;
  constexpr float kU = 0x1p-24f, kUnderflow = 0x1p-80f;
  Value w[3], term[3], reach[3];
  for (int k = 0; k < 3; ++k) {
    w[k] = centre[k] - plane.origin.x[k];
    term[k] = w[k] * plane.normal[k];
    reach[k] = magnitude(plane.normal[k]) * half_extent[k];
  }
  const Value far = sum_of_magnitudes(w) + ((half_extent[0] + half_extent[1]) + half_extent[2]) + 3 * error;
  const Value reached = (reach[0] + reach[1]) + reach[2];
  const Value bound =
      (plane.normal_size + plane.normal_error * far) + 4 * kU * (sum_of_magnitudes(term) + reached);
  return less(1.001f * (reached + bound) + kUnderflow, magnitude((term[0] + term[1]) + term[2]));
}

/// Says on which side of a plane the corners of a triangle lie, where that is certain.
template <typename Mask>
struct Sides {
  Mask above[3], below[3];

  TANDEM_HD Mask strictly_one() const {
    return (above[0] & above[1] & above[2]) | (below[0] & below[1] & below[2]);
  }
  TANDEM_HD Mask all_certain() const {
    return (above[0] | below[0]) & (above[1] | below[1]) & (above[2] | below[2]);
  }
  TANDEM_HD Mask all_ties() const {
    return !(above[0] | below[0] | above[1] | below[1] | above[2] | below[2]);
  }
  /// Returns exact sides, which are neither strictly one nor all ties, with ties below where some corner is
  /// above, and above where none is. Two corners are then on one side, and the third is a
  /// detail::lone_corner(): where some corner is above, it is that one alone, with the others below or in the
  /// plane, or it is below or in the plane, with the others above; where none is, the same upside down.
  TANDEM_HD Sides without_ties() const {
    const Mask some_above = above[0] | above[1] | above[2];
    Sides out;
    for (int i = 0; i < 3; ++i) {
      out.above[i] = above[i] | !(below[i] | some_above);
      out.below[i] = !out.above[i];
    }
    return out;
  }
  /// Returns whether corner i has one side to itself. Condition: the three sides are certain, and not one.
  TANDEM_HD Mask alone(int i) const {
    return (above[i] ^ above[(i + 1) % 3]) & (above[i] ^ above[(i + 2) % 3]);
  }
};

/// Signs as computed.
template <typename Value>
TANDEM_HD inline auto sides_of(const Plane<Value, false>& plane, const Point<Value> (&t)[3]) {
  using Mask = decltype(less(plane.normal[0], plane.normal[0]));
  Sides<Mask> sides;
  for (int i = 0; i < 3; ++i) {
    const Value v = plane.volume(t[i], 0).value;
    sides.above[i] = less(Value{}, v);
    sides.below[i] = less(v, Value{});
  }
  return sides;
}

/// Two edges of a triangle from its first corner, and their sums of magnitudes: the larger, and both.
template <typename Value>
struct Edges {
  Point<Value> of[2];
  Value larger_size, both_sizes;

  TANDEM_HD explicit Edges(const Point<Value> (&t)[3]) : of{difference(t[1], t[0]), difference(t[2], t[0])} {
    const Value size[2] = {sum_of_magnitudes(of[0].x), sum_of_magnitudes(of[1].x)};
    larger_size = larger(size[0], size[1]);
    both_sizes = size[0] + size[1];
  }
};

/// Three volumes, and a bound of the errors of all.
template <typename Value>
struct CornerVolumes {
  Value value[3], bound;
};

/// volume() of the plane of one triangle and the corners of the other. sign * w: from the plane's first
/// corner to the other triangle's.
///
/// **Proof.** As above, with e = 2E + u m and m the larger of |p~|_1 and |q~|_1, of the plane's edges p and
/// q, whose sum is S. A component of p x q is off by at most e (|p_i| + |p_j| + |q_i| + |q_j|) + 2 e^2 <= S e
/// + 2 e^2 for its factors and by 2.01 u |p|_1 |q|_1 <= 0.503 u S^2 for its rounding: nu = S (e + 0.51 u S) +
/// 2 e^2. Let d_0 = 0 and d_1, d_2 be the other triangle's edges, F >= |w|_1 + |d_i|_1. In w~ + d~_i the
/// corner that both start from cancels, so the sum is off by at most E + 1.001 u (|w~_k| + |d~_k|) in
/// coordinate k; n~ by nu; and the sum of at most six products, taken one after another, by 6.1 u |n~|_1 F.
/// Together at most
///
///     |n~|_1 (E + 8 u F) + nu (F + 3 E),
///
/// which is what the code computes; 1.001 and the underflow as there.
template <typename Value>
TANDEM_HD inline CornerVolumes<Value> corner_volumes(const Edges<Value>& plane, const Edges<Value>& other,
                                                     const Point<Value>& w, float sign, float error) {
  constexpr float kU = 0x1p-24f, kUnderflow = 0x1p-80f;
  Value n[3];
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    n[k] = plane.of[0].x[i] * plane.of[1].x[j] - plane.of[0].x[j] * plane.of[1].x[i];
  }
  const Value far = sum_of_magnitudes(w.x) + other.larger_size;
  const Value e = kU * plane.larger_size + 2 * error;
  const Value normal_error = plane.both_sizes * (e + 0.51f * kU * plane.both_sizes) + 2 * (e * e);
  const Value bound =
      1.001f * (sum_of_magnitudes(n) * (8 * kU * far + error) + normal_error * (far + 3 * error)) +
      kUnderflow;
  const Value at = sign * ((n[0] * w.x[0] + n[1] * w.x[1]) + n[2] * w.x[2]);
  const auto along = [&](const Point<Value>& d) {
    return ((at + n[0] * d.x[0]) + n[1] * d.x[1]) + n[2] * d.x[2];
  };
  return {{at, along(other.of[0]), along(other.of[1])}, bound};
}

template <typename Value>
TANDEM_HD inline auto sides_of(const CornerVolumes<Value>& volumes) {
  using Mask = decltype(less(volumes.bound, volumes.bound));
  Sides<Mask> sides;
  for (int i = 0; i < 3; ++i) {
    sides.above[i] = less(volumes.bound, volumes.value[i]);
    sides.below[i] = less(volumes.value[i], -volumes.bound);
  }
  return sides;
}

/// sides_of() b's corners of a's plane, and a's of b's.
template <bool kBounded, typename Value>
TANDEM_HD inline auto sides_of_both(const Point<Value> (&a)[3], const Point<Value> (&b)[3], float error) {
  using Mask = decltype(less(a[0].x[0], a[0].x[0]));
  struct Both {
    Sides<Mask> of_b, of_a;
  };
  if constexpr (!kBounded) {
    return Both{sides_of(Plane<Value, false>(a[0], a[1], a[2], 0), b),
                sides_of(Plane<Value, false>(b[0], b[1], b[2], 0), a)};
  } else {
    const Edges<Value> edges_a(a), edges_b(b);
    const Point<Value> w = difference(b[0], a[0]);
    return Both{sides_of(corner_volumes(edges_a, edges_b, w, 1.0f, error)),
                sides_of(corner_volumes(edges_b, edges_a, w, -1.0f, error))};
  }
}

/// The corners with the lone one first, as they go round.
template <typename Value, typename Mask>
TANDEM_HD inline void lone_first(const Point<Value> (&t)[3], const Sides<Mask>& sides,
                                 Point<Value> (&out)[3]) {
  const Mask first = sides.alone(0), second = sides.alone(1);
  for (int i = 0; i < 3; ++i) {
    out[i] = select_point(first, t[i], select_point(second, t[(i + 1) % 3], t[(i + 2) % 3]));
  }
}

/// The two volumes of order_corners() in triangle_test.h, in its order: the triangles meet where the lower
/// one is at least 0 and the upper one at most 0.
template <typename Value>
struct Intervals {
  Volume<Value> lower, upper;
};

/// Returns the intervals of triangles whose corners lie on both sides of the other's plane. Only b's corners
/// q and r are exchanged, where one of the two orders asks for it, and a's orientation turns the signs
/// instead. (Inlined by force, as vectors go through memory to a call.)
template <bool kBounded, typename Value, typename Mask>
[[gnu::always_inline]] TANDEM_HD inline Intervals<Value> intervals(const Point<Value> (&a)[3],
                                                                   const Point<Value> (&b)[3],
                                                                   const Sides<Mask>& sides_of_a,
                                                                   const Sides<Mask>& sides_of_b,
                                                                   float error) {
  using PlaneOf = Plane<Value, kBounded>;
  Point<Value> oa[3], ob[3];
  lone_first(a, sides_of_a, oa);
  lone_first(b, sides_of_b, ob);
  const auto lone_below = [](const Sides<Mask>& of) {
    const Mask first = of.alone(0), second = of.alone(1), third = !(first | second);
    return (first & of.below[0]) | (second & of.below[1]) | (third & of.below[2]);
  };
  const Mask turned_a = lone_below(sides_of_b), turned_b = lone_below(sides_of_a);
  const Mask exchange = turned_a ^ turned_b;
  const Point<Value> q = select_point(exchange, ob[2], ob[1]), r = select_point(exchange, ob[1], ob[2]);
  Intervals<Value> out = {PlaneOf(oa[0], ob[0], oa[1], error).volume(q, error),
                          PlaneOf(oa[0], ob[0], oa[2], error).volume(r, error)};
  out.lower.value = select(turned_a, -out.lower.value, out.lower.value);
  out.upper.value = select(turned_a, -out.upper.value, out.upper.value);
  return out;
}

/// The answer, lane by lane; apart where neither is set.
template <typename Mask>
struct Verdicts {
  Mask contact, undecided;
};

/// Decides what the error bound allows. a: corners as stored. b: images of the corners in a's frame by
/// box_terms::posed_centre(). error: frame_error(). The method is that of detail::decide_bounded() in
/// triangle_test.h. Without kBounded signs are taken as computed, and what is undecided are ties.
template <bool kBounded, typename Value>
TANDEM_HD inline auto decide(const Point<Value> (&a)[3], const Point<Value> (&b)[3], float error) {
  const auto sides = sides_of_both<kBounded>(a, b, error);
  const auto &sides_of_a = sides.of_a, &sides_of_b = sides.of_b;
  using Mask = decltype(sides_of_a.strictly_one());
  const Mask possible = !(sides_of_b.strictly_one() | sides_of_a.strictly_one());
  const Mask certain = sides_of_a.all_certain() & sides_of_b.all_certain();

  const auto [lower, upper] = intervals<kBounded>(a, b, sides_of_a, sides_of_b, error);
  const Mask apart = less(lower.value, -lower.bound) | less(upper.bound, upper.value);
  const Mask meet = less(lower.bound, lower.value) & less(upper.value, -upper.bound);
  Verdicts<Mask> verdicts;
  verdicts.contact = possible & certain & meet;
  verdicts.undecided = possible & !(certain & (apart | meet));
  return verdicts;
}

}  // namespace frame
}  // namespace tandem
