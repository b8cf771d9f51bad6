#pragma once
#include <array>

#include "bvhbuild/meshing/polygon_mesh.h"

namespace tandem::build {

/// Rows of an affine map in float64: x' = a[0] x + a[1] y + a[2] z + a[3].
using Affine = std::array<std::array<double, 4>, 3>;

inline constexpr Affine kIdentity{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

/// First `inner`, then `outer`. An identity stays out of the arithmetic.
inline Affine combined(const Affine& outer, const Affine& inner) {
  if (outer == kIdentity) return inner;
  if (inner == kIdentity) return outer;
  Affine result{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) {
      double sum = column == 3 ? outer[row][3] : 0;
      for (int k = 0; k < 3; ++k) sum += outer[row][k] * inner[k][column];
      result[row][column] = sum;
    }
  return result;
}

/// An identity stays out of the arithmetic, so that a coordinate that is not finite spoils no other one.
inline Point transformed(const Affine& t, const Point& p) {
  if (t == kIdentity) return p;
  Point q;
  for (int row = 0; row < 3; ++row)
    q[row] = t[row][0] * p[0] + t[row][1] * p[1] + t[row][2] * p[2] + t[row][3];
  return q;
}

}  // namespace tandem::build
