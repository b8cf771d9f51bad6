#pragma once
#include <cmath>

#include "kernels/geometry/relative_pose.h"
#include "tandem/formats/box.h"
#include "tandem/formats/platform.h"

/// Separating-axis tests of two boxes, one posed relative to the other, float32, for CPU and GPU.
/// Source: Gottschalk, Lin and Manocha 1996. Every comparison has the form |d| <= r and must be true to go
/// on: the form in which imaginary nodes reject themselves (proof at kImaginaryHalfExtent,
/// tandem/formats/block.h; slack is finite, so -infinity + slack is -infinity).
///
/// With a pose from relative_pose() the tests are conservative whether or not a compiler fuses multiplies
/// and adds, and whether or not the machine flushes subnormals to zero (docs/box_test.md).
namespace tandem {

/// The terms of the tests, each written once: Value is float, or a vector with a box in each lane, which has
/// the same operators. The order of operations is the same in both, and so are the results, bit by bit.
/// Arguments: half-extents with their slack added; d is the distance of the centres in a's frame. Edge axis
/// (i, j) is a's axis i cross b's axis j.
namespace box_terms {

template <typename Value>
TANDEM_HD inline Value dot(float x, float y, float z, const Value (&v)[3]) {
  return (x * v[0] + y * v[1]) + z * v[2];
}

/// Coordinate i of b's centre in a's frame.
template <typename Value>
TANDEM_HD inline Value posed_centre(const RelativePose& pose, int i, const Value (&centre_b)[3]) {
  const float* row = pose.rotation[i];
  return dot(row[0], row[1], row[2], centre_b) + pose.translation[i];
}

/// Returns how far b reaches along a's axis i.
template <typename Value>
TANDEM_HD inline Value b_on_face(const RelativePose& pose, int i, const Value (&half_extent_b)[3]) {
  const float* row = pose.abs_rotation[i];
  return dot(row[0], row[1], row[2], half_extent_b);
}

/// Returns how far a reaches along b's axis j.
template <typename Value>
TANDEM_HD inline Value a_on_face(const RelativePose& pose, int j, const Value (&half_extent_a)[3]) {
  const auto& m = pose.abs_rotation;
  return dot(m[0][j], m[1][j], m[2][j], half_extent_a);
}

template <typename Value>
TANDEM_HD inline Value distance_on_face(const RelativePose& pose, int j, const Value (&d)[3]) {
  const auto& m = pose.rotation;
  return dot(m[0][j], m[1][j], m[2][j], d);
}

template <typename Value>
TANDEM_HD inline Value a_on_edge(const RelativePose& pose, int i, int j, const Value (&half_extent_a)[3]) {
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
  return pose.abs_rotation[i2][j] * half_extent_a[i1] + pose.abs_rotation[i1][j] * half_extent_a[i2];
}

template <typename Value>
TANDEM_HD inline Value b_on_edge(const RelativePose& pose, int i, int j, const Value (&half_extent_b)[3]) {
  const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
  return pose.abs_rotation[i][j2] * half_extent_b[j1] + pose.abs_rotation[i][j1] * half_extent_b[j2];
}

template <typename Value>
TANDEM_HD inline Value distance_on_edge(const RelativePose& pose, int i, int j, const Value (&d)[3]) {
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
  return pose.rotation[i1][j] * d[i2] - pose.rotation[i2][j] * d[i1];
}

}  // namespace box_terms

namespace detail {

/// The numbers that all axes share: distance of the centres in a's frame, half-extents with their slack.
struct BoxDistance {
  float d[3];
  float half_extent_a[3], half_extent_b[3];
};

TANDEM_HD inline BoxDistance distance(const Box& a, const Box& b, const RelativePose& b_in_a) {
  BoxDistance out;
  for (int i = 0; i < 3; ++i) {
    out.d[i] = box_terms::posed_centre(b_in_a, i, b.centre) - a.centre[i];
    out.half_extent_a[i] = a.half_extent[i] + b_in_a.slack_a[i];
    out.half_extent_b[i] = b.half_extent[i] + b_in_a.slack_b[i];
  }
  return out;
}

TANDEM_HD inline bool overlap_on_face_axes(const BoxDistance& s, const RelativePose& b_in_a) {
  bool overlap = true;
  for (int i = 0; i < 3; ++i) {
    const float r = s.half_extent_a[i] + box_terms::b_on_face(b_in_a, i, s.half_extent_b);
    overlap = overlap && std::fabs(s.d[i]) <= r;
  }
  for (int j = 0; j < 3; ++j) {
    const float r = s.half_extent_b[j] + box_terms::a_on_face(b_in_a, j, s.half_extent_a);
    overlap = overlap && std::fabs(box_terms::distance_on_face(b_in_a, j, s.d)) <= r;
  }
  return overlap;
}

/// Near-parallel edges give an axis of almost no length, on which d and r both vanish: such an axis proves
/// nothing, and slack keeps rounding from making it separate.
TANDEM_HD inline bool overlap_on_edge_axes(const BoxDistance& s, const RelativePose& b_in_a) {
  bool overlap = true;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const float r = box_terms::a_on_edge(b_in_a, i, j, s.half_extent_a) +
                      box_terms::b_on_edge(b_in_a, i, j, s.half_extent_b);
      overlap = overlap && std::fabs(box_terms::distance_on_edge(b_in_a, i, j, s.d)) <= r;
    }
  }
  return overlap;
}

}  // namespace detail

/// Returns whether no face normal of either box separates them: 6 axes. May say yes where overlap_15_axes
/// says no.
TANDEM_HD inline bool overlap_6_axes(const Box& a, const Box& b, const RelativePose& b_in_a) {
  return detail::overlap_on_face_axes(detail::distance(a, b, b_in_a), b_in_a);
}

/// Returns whether no axis separates the boxes: 6 face normals, then the 9 cross products of edges.
TANDEM_HD inline bool overlap_15_axes(const Box& a, const Box& b, const RelativePose& b_in_a) {
  const detail::BoxDistance s = detail::distance(a, b, b_in_a);
  return detail::overlap_on_face_axes(s, b_in_a) && detail::overlap_on_edge_axes(s, b_in_a);
}

}  // namespace tandem
