#pragma once
#include <cmath>

#include "tandem/formats/box.h"
#include "tandem/formats/platform.h"

/// Separating-axis tests of two boxes, one posed relative to the other, float32, for CPU and GPU.
/// Source: Gottschalk, Lin and Manocha 1996. Every comparison has the form |d| <= r and must be true to go
/// on: the form in which imaginary nodes reject themselves (proof at kImaginaryHalfExtent,
/// tandem/formats/block.h).
namespace tandem {

/// Where b's frame lies in a's: x_a = rotation * x_b + translation.
struct RelativePose {
  float rotation[3][3];
  float translation[3];
  float slack;  ///< added to every radius, in length units: how much rounding may bring boxes apart at most;
                ///< 0 to take boxes as they come
};

namespace detail {

/// What all axes share: the distance of the centres in a's frame, and |rotation|.
struct BoxDistance {
  float d[3];
  float abs_rotation[3][3];
};

TANDEM_HD inline BoxDistance distance(const Box& a, const Box& b, const RelativePose& b_in_a) {
  BoxDistance out;
  for (int i = 0; i < 3; ++i) {
    const float* row = b_in_a.rotation[i];
    out.d[i] = row[0] * b.center[0] + row[1] * b.center[1] + row[2] * b.center[2] + b_in_a.translation[i] -
               a.center[i];
    for (int j = 0; j < 3; ++j) out.abs_rotation[i][j] = std::fabs(row[j]);
  }
  return out;
}

TANDEM_HD inline bool overlap_on_face_axes(const Box& a, const Box& b, const RelativePose& b_in_a,
                                           const BoxDistance& s) {
  const float* ha = a.half_extent;
  const float* hb = b.half_extent;
  bool overlap = true;
  for (int i = 0; i < 3; ++i) {
    const float* row = s.abs_rotation[i];
    const float r = ha[i] + (row[0] * hb[0] + row[1] * hb[1] + row[2] * hb[2]) + b_in_a.slack;
    overlap = overlap && std::fabs(s.d[i]) <= r;
  }
  for (int j = 0; j < 3; ++j) {
    const float d =
        s.d[0] * b_in_a.rotation[0][j] + s.d[1] * b_in_a.rotation[1][j] + s.d[2] * b_in_a.rotation[2][j];
    const float r =
        hb[j] + (s.abs_rotation[0][j] * ha[0] + s.abs_rotation[1][j] * ha[1] + s.abs_rotation[2][j] * ha[2]) +
        b_in_a.slack;
    overlap = overlap && std::fabs(d) <= r;
  }
  return overlap;
}

/// Axes a_i x b_j. Near-parallel edges give an axis of almost no length, on which d and r both vanish: such
/// an axis proves nothing, and slack keeps rounding from making it separate.
TANDEM_HD inline bool overlap_on_edge_axes(const Box& a, const Box& b, const RelativePose& b_in_a,
                                           const BoxDistance& s) {
  const float* ha = a.half_extent;
  const float* hb = b.half_extent;
  bool overlap = true;
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const float d = s.d[i2] * b_in_a.rotation[i1][j] - s.d[i1] * b_in_a.rotation[i2][j];
      const float r = (ha[i1] * s.abs_rotation[i2][j] + ha[i2] * s.abs_rotation[i1][j]) +
                      (hb[j1] * s.abs_rotation[i][j2] + hb[j2] * s.abs_rotation[i][j1]) + b_in_a.slack;
      overlap = overlap && std::fabs(d) <= r;
    }
  }
  return overlap;
}

}  // namespace detail

/// Whether no face normal of either box separates them: 6 axes. May say yes where overlap_15_axes says no.
TANDEM_HD inline bool overlap_6_axes(const Box& a, const Box& b, const RelativePose& b_in_a) {
  return detail::overlap_on_face_axes(a, b, b_in_a, detail::distance(a, b, b_in_a));
}

/// Whether no axis separates the boxes: 6 face normals, then the 9 cross products of edges.
TANDEM_HD inline bool overlap_15_axes(const Box& a, const Box& b, const RelativePose& b_in_a) {
  const detail::BoxDistance s = detail::distance(a, b, b_in_a);
  return detail::overlap_on_face_axes(a, b, b_in_a, s) && detail::overlap_on_edge_axes(a, b, b_in_a, s);
}

/// Whether two boxes of one frame overlap, touching included.
TANDEM_HD inline bool overlap_aligned(const Box& a, const Box& b) {
  bool overlap = true;
  for (int k = 0; k < 3; ++k) {
    overlap = overlap && std::fabs(a.center[k] - b.center[k]) <= a.half_extent[k] + b.half_extent[k];
  }
  return overlap;
}

}  // namespace tandem
