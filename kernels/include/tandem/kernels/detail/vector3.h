#pragma once
#include <cmath>

#include "tandem/formats/platform.h"

/// A function that a GPU calls instead of copying it to where it is called from, and a loop whose body it has
/// once: code that warps share stays in their cache, and what is seldom done takes no registers.
#if defined(__CUDACC__)
#define TANDEM_HD_CALLED __host__ __device__ __noinline__
#define TANDEM_ROLLED _Pragma("unroll 1")
#else
#define TANDEM_HD_CALLED
#define TANDEM_ROLLED
#endif

/// Vectors of float64 for contact manifolds. Every operation is rounded by itself: host code is compiled with
/// -ffp-contract=off and device code with --fmad=false, so that both give the same bits.
namespace tandem::manifold {

/// Return the smaller and the larger number. Each is one instruction, where fmin() and fmax() of a C library
/// may be calls. If one is NaN, the result is the second.
template <typename T>
TANDEM_HD inline T lesser(T x, T y) {
  return x < y ? x : y;
}
template <typename T>
TANDEM_HD inline T greater(T x, T y) {
  return x > y ? x : y;
}

struct Vector3 {
  double x = 0, y = 0, z = 0;

  TANDEM_HD friend Vector3 operator+(const Vector3& p, const Vector3& q) {
    return {p.x + q.x, p.y + q.y, p.z + q.z};
  }
  TANDEM_HD friend Vector3 operator-(const Vector3& p, const Vector3& q) {
    return {p.x - q.x, p.y - q.y, p.z - q.z};
  }
  TANDEM_HD friend Vector3 operator*(double s, const Vector3& p) { return {s * p.x, s * p.y, s * p.z}; }
  TANDEM_HD Vector3 operator-() const { return {-x, -y, -z}; }
};

TANDEM_HD inline double dot(const Vector3& p, const Vector3& q) {
  return p.x * q.x + p.y * q.y + p.z * q.z;
}
TANDEM_HD inline Vector3 cross(const Vector3& p, const Vector3& q) {
  return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
}
TANDEM_HD inline double norm(const Vector3& p) {
  return std::sqrt(dot(p, p));
}

/// Returns the vector of length 1 in the direction of p. Condition: p is not 0, and its square neither
/// overflows nor vanishes.
TANDEM_HD inline Vector3 normalized(const Vector3& p) {
  return (1 / norm(p)) * p;
}

/// A unit vector across a unit vector.
TANDEM_HD inline Vector3 unit_orthogonal(const Vector3& n) {
  const double x = std::fabs(n.x), y = std::fabs(n.y), z = std::fabs(n.z);
  const Vector3 least = x <= y && x <= z ? Vector3{1, 0, 0} : y <= z ? Vector3{0, 1, 0} : Vector3{0, 0, 1};
  return normalized(cross(n, least));
}

/// A point in the plane of a patch.
struct Vector2 {
  double x = 0, y = 0;

  TANDEM_HD friend Vector2 operator+(const Vector2& p, const Vector2& q) { return {p.x + q.x, p.y + q.y}; }
  TANDEM_HD friend Vector2 operator-(const Vector2& p, const Vector2& q) { return {p.x - q.x, p.y - q.y}; }
  TANDEM_HD friend Vector2 operator*(double s, const Vector2& p) { return {s * p.x, s * p.y}; }
};

TANDEM_HD inline double dot(const Vector2& p, const Vector2& q) {
  return p.x * q.x + p.y * q.y;
}
TANDEM_HD inline double cross(const Vector2& p, const Vector2& q) {
  return p.x * q.y - p.y * q.x;
}
TANDEM_HD inline double norm(const Vector2& p) {
  return std::sqrt(dot(p, p));
}

}  // namespace tandem::manifold
