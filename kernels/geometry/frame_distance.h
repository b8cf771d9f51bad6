#pragma once
#include <cmath>

#include "kernels/geometry/box_distance.h"
#include "kernels/geometry/nearest_features.h"

/// The distance of two triangles as float32 knows it in the frame of the first instance, for CPU and GPU.
///
/// **Proof.** E of frame_test.h bounds, coordinate by coordinate, how far the image of a corner of a is from
/// the corner as stored, and that of one of b from posed() of it, both together. So for points p and q of the
/// posed triangles, N (p - q) differs from the difference of the same points of the float32 triangles by at
/// most E a coordinate, and their distance in the frame by sqrt(3) E < 1.7321 E. For the float32 triangles
/// the proof in triangle_distance.h holds with u = 2^-24: both bounds are relative to a[0] and to M there.
/// The difference of the two points, `apart`, is made of offsets with parameters from 0 to 1 there too: an
/// offset of two corners (4 u M), two edges times a parameter (6 u M each) and two sums (8 u M) are 24 u M a
/// coordinate, below the 40 u M that it has. Directions too short to be sure of, where |n|_1 < 2^-40, give 0;
/// from there on underflow, a few times 2^-126, is below 2^-104 < 0.09 u |n|_1 M, as M >= |n|_1 / 6.
namespace tandem::distance {

/// Lengths in a's frame that the distance is not below, and not above.
template <typename Value>
struct FrameInterval {
  Value lower, upper;
  Point<Value> along;  ///< from b to a, of any length: the direction that `lower` is told by
};

/// A direction in a's frame, and how far apart along it triangles must be to be at least a given distance
/// apart in the world.
struct FrameDirection {
  float n[3];      ///< |n| <= 1
  float length;    ///< in a's frame, with all errors but those that grow with the triangles
  float relative;  ///< these, for each unit of M in the proof
};

/// If `along` is too short to tell its direction, nothing counts as far.
TANDEM_HD inline FrameDirection frame_direction(const DistanceFrame& frame, const float (&along)[3],
                                                double at_least) {
  double square = 0, sum = 0;
  for (const float x : along) square += static_cast<double>(x) * static_cast<double>(x);
  // Rounding to float32 makes |n| larger by u at most.
  const double factor = square > 0 ? (1 - 0x1p-22) / std::sqrt(square) : 0;
  FrameDirection out;
  for (int k = 0; k < 3; ++k) {
    out.n[k] = static_cast<float>(static_cast<double>(along[k]) * factor);
    sum += std::fabs(static_cast<double>(out.n[k]));
  }
  const double length = at_least / frame.least_in_world + 1.7321 * static_cast<double>(frame.error);
  out.length = length < 0x1p100 ? static_cast<float>(length * (1 + 0x1p-20) + 0x1p-100) : INFINITY;
  out.relative = static_cast<float>(9.2 * 0x1p-24 * sum);
  return out;
}

TANDEM_HD inline float square_root(float x) {
  return std::sqrt(x);
}

template <typename Value>
TANDEM_HD inline Value least_of(const Value& x, const Value& y, const Value& z) {
  const Value first = select(less(y, x), y, x);
  return select(less(z, first), z, first);
}

template <typename Value>
TANDEM_HD inline Value greatest_of(const Value& x, const Value& y, const Value& z) {
  return larger(larger(x, y), z);
}

/// Returns whether the posed triangles are at least as far apart as frame_direction() was asked for, along
/// that direction: what the proof says of `lower`, with |n| <= 1. a: corners as stored, b: posed() ones.
template <typename Value>
TANDEM_HD inline auto is_far_along(const Point<Value> (&corner_a)[3], const Point<Value> (&corner_b)[3],
                                   const FrameDirection& along) {
  Value of_a[3], of_b[3], largest{};
  for (int i = 0; i < 3; ++i) {
    const Point<Value> a = minus(corner_a[i], corner_a[0]), b = minus(corner_b[i], corner_a[0]);
    of_a[i] = (along.n[0] * a.x[0] + along.n[1] * a.x[1]) + along.n[2] * a.x[2];
    of_b[i] = (along.n[0] * b.x[0] + along.n[1] * b.x[1]) + along.n[2] * b.x[2];
    largest = larger(largest, larger(frame::largest_magnitude(a.x), frame::largest_magnitude(b.x)));
  }
  const Value gap = least_of(of_a[0], of_a[1], of_a[2]) - greatest_of(of_b[0], of_b[1], of_b[2]);
  return less(along.relative * largest + along.length, gap);
}

/// The interval that a guess tells. gap: how far a lies beyond b along nearest.along, as computed; largest: M
/// of the proof; error: E.
template <typename Value>
TANDEM_HD inline FrameInterval<Value> interval_of(const Nearest<Value>& nearest, const Value& gap,
                                                  const Value& largest, float error) {
  constexpr float kU = 0x1p-24f;
  const float off = 1.7321f * error * (1 + 8 * kU);
  const Point<Value>& n = nearest.along;
  const Value length = square_root(dot(n, n)), n_1 = frame::sum_of_magnitudes(n.x);
  const Value sure = gap - (9.1f * kU) * (n_1 * largest);
  const auto counts = less(value_of<Value>(0x1p-40), n_1) & less(Value{}, sure);
  const Value quotient = sure / select(counts, length, value_of<Value>(1));
  const Value lower = select(counts, (1 - 12 * kU) * quotient + (-off), Value{});
  FrameInterval<Value> out;
  out.along = n;
  out.lower = select(less(Value{}, lower), lower, Value{});
  const Point<Value>& apart = nearest.apart;
  out.upper = (1 + 12 * kU) * square_root(dot(apart, apart)) + ((84 * kU) * largest + (off + 0x1p-60f));
  return out;
}

/// a: corners as stored, b: posed() ones. error: frame_error().
template <typename Value>
TANDEM_HD inline FrameInterval<Value> frame_interval(const Point<Value> (&corner_a)[3],
                                                     const Point<Value> (&corner_b)[3], float error) {
  Point<Value> a[3], b[3];
  Value largest{};
  for (int i = 0; i < 3; ++i) {
    a[i] = minus(corner_a[i], corner_a[0]);
    b[i] = minus(corner_b[i], corner_a[0]);
    for (int k = 0; k < 3; ++k) largest = larger(largest, larger(magnitude(a[i].x[k]), magnitude(b[i].x[k])));
  }
  const Nearest<Value> nearest = nearest_features<Value>(a, b, value_of<Value>(0x1p-60));
  const Point<Value>& n = nearest.along;
  const Value gap = least_of(dot(n, a[0]), dot(n, a[1]), dot(n, a[2])) -
                    greatest_of(dot(n, b[0]), dot(n, b[1]), dot(n, b[2]));
  return interval_of(nearest, gap, largest, error);
}

/// The clearance that is asked of a pair of instances: a distance in the world, as lengths in a's frame.
struct FrameClearance {
  float apart_from;  ///< what is farther apart than this is farther apart than asked, in the world
  float within_to;   ///< what is no farther apart than this is within what is asked
  float error;       ///< frame_error()
};

TANDEM_HD inline FrameClearance frame_clearance(const DistanceFrame& frame, double distance) {
  const double apart = distance / frame.least_in_world * (1 + 0x1p-22) + 0x1p-100,
               within = distance / frame.most_in_world * (1 - 0x1p-22) - 0x1p-100;
  return {apart < 0x1p100 ? static_cast<float>(apart) : INFINITY,
          within > 0 ? within < 0x1p100 ? static_cast<float>(within) : 0x1p100f : -1.0f, frame.error};
}

/// Returns whether two triangles lie more than a length apart along n or against it: the proof above, with
/// 9.2 u for its 9.1, and 8 u for |n| as computed. M: `largest`. A direction that underflow could touch tells
/// nothing.
template <typename Value>
TANDEM_HD inline auto is_beyond_along(const Point<Value>& n, const Point<Value> (&a)[3],
                                      const Point<Value> (&b)[3], const Value& largest, float length) {
  constexpr float kU = 0x1p-24f;
  const Value of_a[3] = {dot(n, a[0]), dot(n, a[1]), dot(n, a[2])},
              of_b[3] = {dot(n, b[0]), dot(n, b[1]), dot(n, b[2])};
  const Value above = least_of(of_b[0], of_b[1], of_b[2]) - greatest_of(of_a[0], of_a[1], of_a[2]);
  const Value below = least_of(of_a[0], of_a[1], of_a[2]) - greatest_of(of_b[0], of_b[1], of_b[2]);
  const Value n_1 = frame::sum_of_magnitudes(n.x), size = n_1 * largest;
  const Value needed = length * square_root(dot(n, n)) + (9.2f * kU) * size;
  return less(value_of<Value>(0x1p-55), n_1) & less(value_of<Value>(0x1p-80), size) &
         less(needed, larger(above, below));
}

/// The quick answers about clearance: surely farther apart than asked, by the triangles' boxes in a's frame
/// or by the plane of either, or surely within it, by two of their corners or because they meet.
template <typename Mask>
struct Sifted {
  Mask beyond, within;
};

/// a: corners as stored, b: posed() ones. tries_contact: whether it looks if they meet, which decide_within()
/// does too: it pays where the first pair ends the search.
template <typename Value>
TANDEM_HD inline auto sift(const Point<Value> (&corner_a)[3], const Point<Value> (&corner_b)[3],
                           const FrameClearance& clearance, bool tries_contact) {
  Point<Value> a[3], b[3];
  Value largest{}, widest = value_of<Value>(-1);
  for (int i = 0; i < 3; ++i) {
    a[i] = minus(corner_a[i], corner_a[0]);
    b[i] = minus(corner_b[i], corner_a[0]);
    largest = larger(largest, larger(frame::largest_magnitude(a[i].x), frame::largest_magnitude(b[i].x)));
  }
  for (int k = 0; k < 3; ++k) {
    const Value above =
        least_of(b[0].x[k], b[1].x[k], b[2].x[k]) - greatest_of(a[0].x[k], a[1].x[k], a[2].x[k]);
    const Value below =
        least_of(a[0].x[k], a[1].x[k], a[2].x[k]) - greatest_of(b[0].x[k], b[1].x[k], b[2].x[k]);
    widest = larger(widest, larger(above, below));
  }
  Value square = value_of<Value>(0x1p100);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Point<Value> apart = minus(a[i], b[j]);
      const Value next = dot(apart, apart);
      square = select(less(next, square), next, square);
    }
  }
  constexpr float kU = 0x1p-24f;
  const float off = 1.7321f * clearance.error;
  const float length = (clearance.apart_from + off) * (1 + 16 * kU);
  Sifted<decltype(less(square, widest))> out;
  // Along an axis, differences are the only roundings: of u M each, and one of their own.
  out.beyond = less((5 * kU) * largest + length, widest) |
               is_beyond_along(cross(minus(a[1], a[0]), minus(a[2], a[0])), a, b, largest, length) |
               is_beyond_along(cross(minus(b[1], b[0]), minus(b[2], b[0])), a, b, largest, length);
  // Corners are off by 2 u M a coordinate, and their difference by 2 u M more.
  const Value distance = (1 + 12 * kU) * square_root(square) + ((8 * kU) * largest + (off + 0x1p-60f));
  out.within = less(distance, value_of<Value>(clearance.within_to));
  if (tries_contact)
    out.within = out.within | frame::decide<true>(corner_a, corner_b, clearance.error).contact;
  return out;
}

/// Returns what frame_interval() knows of clearance; triangles that meet have features that may be apart, so
/// the contact test decides about them: `contact` where the posed triangles are surely within it.
template <typename Value>
TANDEM_HD inline auto decide_within(const Point<Value> (&a)[3], const Point<Value> (&b)[3],
                                    const FrameClearance& clearance) {
  const FrameInterval<Value> interval = frame_interval(a, b, clearance.error);
  frame::Verdicts<decltype(less(interval.lower, interval.upper))> verdicts;
  verdicts.contact = less(interval.upper, value_of<Value>(clearance.within_to)) |
                     frame::decide<true>(a, b, clearance.error).contact;
  verdicts.undecided = !(verdicts.contact | less(value_of<Value>(clearance.apart_from), interval.lower));
  return verdicts;
}

}  // namespace tandem::distance
