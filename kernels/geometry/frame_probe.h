#pragma once
#include "kernels/geometry/frame_distance.h"
#include "kernels/geometry/local_frame.h"

/// The float32 tests of a walk by a point or a ray, for CPU and GPU; local_frame.h has the proofs.
///
/// Templates over Value: float, or a vector with a node or triangle in each lane, see frame_test.h.
namespace tandem::probe {

using frame::larger;
using frame::less;
using frame::magnitude;
using frame::Point;

// frame_test.h has the others for float.
TANDEM_HD inline float lesser(float x, float y) {
#ifdef __CUDA_ARCH__
  return fminf(x, y);  // one instruction; of NaN nothing is decided either way
#else
  return y < x ? y : x;
#endif
}

/// The part of a ray that tests of boxes need.
template <typename Value>
struct RayInFrame {
  Value o[3], inverse[3], size[3], slack;
};

template <typename Value>
TANDEM_HD inline RayInFrame<Value> ray_in_frame(const LocalRay& ray) {
  RayInFrame<Value> out;
  for (int k = 0; k < 3; ++k) {
    out.o[k] = Value{} + ray.o[k];
    out.inverse[k] = Value{} + ray.inverse[k];
    out.size[k] = magnitude(out.inverse[k]);
  }
  out.slack = Value{} + ray.slack;
  return out;
}

/// Returns whether the ray surely misses a box up to the limit; first: the parameter at which it meets it, at
/// the earliest.
template <typename Value>
TANDEM_HD inline auto misses_box(const RayInFrame<Value>& ray, const Value (&centre)[3],
                                 const Value (&half_extent)[3], const Value& limit, Value& first) {
  Value last = limit;
  first = Value{};
  for (int k = 0; k < 3; ++k) {
    const Value m = (centre[k] - ray.o[k]) * ray.inverse[k];
    const Value r = (half_extent[k] + ray.slack) * ray.size[k];
    first = larger(first, m - r);
    last = lesser(last, m + r);
  }
  return less(last, first);
}

/// det(d, p, e) as computed.
template <typename Value>
TANDEM_HD inline Value side_of(const float (&d)[3], const Point<Value>& p, const Point<Value>& e) {
  return (d[0] * (p.x[1] * e.x[2] - p.x[2] * e.x[1]) + d[1] * (p.x[2] * e.x[0] - p.x[0] * e.x[2])) +
         d[2] * (p.x[0] * e.x[1] - p.x[1] * e.x[0]);
}

/// Returns whether the line of the ray surely passes a triangle. o: of the ray.
template <typename Value>
TANDEM_HD inline auto passes_triangle(const LocalRay& ray, const Value (&o)[3],
                                      const Point<Value> (&corner)[3]) {
  Value largest{};
  Point<Value> p[3], e[3];
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      p[i].x[k] = corner[i].x[k] - o[k];
      e[i].x[k] = corner[(i + 1) % 3].x[k] - corner[i].x[k];
      largest = larger(largest, magnitude(e[i].x[k]));
    }
  }
  Value least = side_of(ray.d, p[0], e[0]), most = least;
  for (int i = 1; i < 3; ++i) {
    const Value w = side_of(ray.d, p[i], e[i]);
    least = lesser(least, w);
    most = larger(most, w);
  }
  const Value bound = ray.edge_factor * largest + ray.least_bound;
  return less(least, Value{} - bound) & less(bound, most);
}

/// The square of a length that whatever is below a node is away from the point, at least: a box bound, of
/// which distance::limit_of() tells the meaning.
template <typename Value>
TANDEM_HD inline Value box_bound(const Value (&q)[3], const Value (&slack)[3], const Value (&centre)[3],
                                 const Value (&half_extent)[3]) {
  Value square[3];
  for (int k = 0; k < 3; ++k) {
    const Value gap = magnitude(centre[k] - q[k]) - (half_extent[k] + slack[k]);
    const Value beyond = larger(gap, Value{});
    square[k] = beyond * beyond;
  }
  return (square[0] + square[1]) + square[2];
}

/// Bounds the distance of a triangle from the point. error: of the LocalPoint.
template <typename Value>
TANDEM_HD inline distance::FrameInterval<Value> triangle_interval(const Value (&q)[3], float error,
                                                                  const Point<Value> (&corner)[3]) {
  Value largest{};
  Point<Value> from_point[3];
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      from_point[i].x[k] = corner[i].x[k] - q[k];
      largest = larger(largest, magnitude(from_point[i].x[k]));
    }
  }
  const auto nearest = distance::nearest_to_origin<Value>(from_point, distance::value_of<Value>(0x1p-60));
  const auto& n = nearest.along;
  const Value gap = distance::least_of(distance::dot(n, from_point[0]), distance::dot(n, from_point[1]),
                                       distance::dot(n, from_point[2]));
  return distance::interval_of(nearest, gap, largest, error);
}

/// The length in a body's frame from which on whatever is as far is at least so far away, in the world.
TANDEM_HD inline float length_limit_of(const FrameLengths& lengths, double distance) {
  return rounded_up(distance / lengths.least_in_world);
}

/// The distance in the world that a length in a body's frame is at most.
TANDEM_HD inline double world_upper_of(const FrameLengths& lengths, float length) {
  return static_cast<double>(length) * lengths.most_in_world;
}

}  // namespace tandem::probe
