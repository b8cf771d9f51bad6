#pragma once
#include "kernels/geometry/ray_triangle.h"

namespace tandem {

/// The row of a hit, for CPU and GPU.
TANDEM_HD inline RayHit row_of(std::uint32_t ray, const ray::FoundHit& hit, std::uint32_t face) {
  RayHit row;
  row.t = hit.meeting.t.lower + (hit.meeting.t.upper - hit.meeting.t.lower) / 2;
  row.weight[0] = hit.meeting.weight[0];
  row.weight[1] = hit.meeting.weight[1];
  row.ray = ray;
  row.body = hit.body;
  row.triangle = hit.triangle;
  row.face = face;
  return row;
}

/// The row of a ray that hits nothing.
TANDEM_HD inline RayHit row_without_hit(std::uint32_t ray) {
  return {HUGE_VAL, {0, 0}, ray, kNoIndex, kNoIndex, kNoIndex};
}

}  // namespace tandem
