#pragma once
#include "peer_mesh.h"
#include "tandem/kernels/detail/triangle_test.h"

namespace tandem::bench {
namespace detail {

/// Signs as float64 computes them, right or wrong.
struct Float64Signs {
  static int sign(double x) { return (x > 0) - (x < 0); }

  /// det(q - p, r - p, s - p)
  static int volume(const double* p, const double* q, const double* r, const double* s) {
    double a[3], b[3], c[3];
    for (int k = 0; k < 3; ++k) a[k] = q[k] - p[k], b[k] = r[k] - p[k], c[k] = s[k] - p[k];
    return sign(c[0] * (a[1] * b[2] - a[2] * b[1]) + c[1] * (a[2] * b[0] - a[0] * b[2]) +
                c[2] * (a[0] * b[1] - a[1] * b[0]));
  }

  /// Component k of (q - p) x (r - p).
  static int area(const double* p, const double* q, const double* r, int k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    return sign((q[i] - p[i]) * (r[j] - p[j]) - (q[j] - p[j]) * (r[i] - p[i]));
  }
};

}  // namespace detail

/// Whether two posed triangles meet by plain float64: Guigue and Devillers' test with all its ties, signs
/// taken as they come out. What a careful user of a library that finds candidates only would write.
inline bool meet_in_float64(const PosedTriangle& a, const PosedTriangle& b) {
  return tandem::detail::CompleteTest<detail::Float64Signs>::meet(a.corner, b.corner);
}

}  // namespace tandem::bench
