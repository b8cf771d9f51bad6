#pragma once
#include <cmath>

#include "tandem/kernels/detail/vector3.h"
#include "tandem/kernels/pose.h"

/// Vectors, matrices and rotations of rigid bodies, in float64, for host and device. Every operation is
/// rounded by itself, so both give the same bits.
namespace tandem::dynamics {

using manifold::cross;
using manifold::dot;
using manifold::greater;
using manifold::lesser;
using manifold::norm;
using manifold::normalized;
using manifold::unit_orthogonal;
using manifold::Vector3;

TANDEM_HD inline double square(const Vector3& p) {
  return dot(p, p);
}
TANDEM_HD inline Vector3& operator+=(Vector3& p, const Vector3& q) {
  return p = p + q;
}
TANDEM_HD inline Vector3& operator-=(Vector3& p, const Vector3& q) {
  return p = p - q;
}
TANDEM_HD inline bool operator==(const Vector3& p, const Vector3& q) {
  return p.x == q.x && p.y == q.y && p.z == q.z;
}
TANDEM_HD inline Vector3 operator/(const Vector3& p, double s) {
  return {p.x / s, p.y / s, p.z / s};
}
TANDEM_HD inline Vector3 operator*(const Vector3& p, double s) {
  return s * p;
}
TANDEM_HD inline Vector3 vector_of(const double (&x)[3]) {
  return {x[0], x[1], x[2]};
}
TANDEM_HD inline Vector3 vector_of(const float (&x)[3]) {
  return {x[0], x[1], x[2]};
}
TANDEM_HD inline double at(const Vector3& p, int k) {
  return k == 0 ? p.x : k == 1 ? p.y : p.z;
}
TANDEM_HD inline bool is_finite(const Vector3& p) {
  return std::fabs(p.x) <= 1.7976931348623157e308 && std::fabs(p.y) <= 1.7976931348623157e308 &&
         std::fabs(p.z) <= 1.7976931348623157e308;
}

struct Matrix3 {
  Vector3 row[3];

  TANDEM_HD static Matrix3 identity() { return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; }

  TANDEM_HD friend Vector3 operator*(const Matrix3& m, const Vector3& x) {
    return {dot(m.row[0], x), dot(m.row[1], x), dot(m.row[2], x)};
  }
  TANDEM_HD friend Matrix3 operator+(const Matrix3& m, const Matrix3& n) {
    return {{m.row[0] + n.row[0], m.row[1] + n.row[1], m.row[2] + n.row[2]}};
  }
  TANDEM_HD friend Matrix3 operator-(const Matrix3& m, const Matrix3& n) {
    return {{m.row[0] - n.row[0], m.row[1] - n.row[1], m.row[2] - n.row[2]}};
  }
  TANDEM_HD friend Matrix3 operator*(double s, const Matrix3& m) {
    return {{s * m.row[0], s * m.row[1], s * m.row[2]}};
  }
};

TANDEM_HD inline Matrix3 transposed(const Matrix3& m) {
  const Vector3 *r = m.row, &p = r[0], &q = r[1], &s = r[2];
  return {{{p.x, q.x, s.x}, {p.y, q.y, s.y}, {p.z, q.z, s.z}}};
}
TANDEM_HD inline Matrix3 operator*(const Matrix3& m, const Matrix3& n) {
  const Matrix3 columns = transposed(n);
  Matrix3 out;
  for (int i = 0; i < 3; ++i)
    out.row[i] = {dot(m.row[i], columns.row[0]), dot(m.row[i], columns.row[1]),
                  dot(m.row[i], columns.row[2])};
  return out;
}
/// p q^T
TANDEM_HD inline Matrix3 outer(const Vector3& p, const Vector3& q) {
  return {{p.x * q, p.y * q, p.z * q}};
}
TANDEM_HD inline double trace(const Matrix3& m) {
  return m.row[0].x + m.row[1].y + m.row[2].z;
}
/// Condition: the matrix is not singular.
TANDEM_HD inline Matrix3 inverse(const Matrix3& m) {
  const Vector3 p = cross(m.row[1], m.row[2]), q = cross(m.row[2], m.row[0]), s = cross(m.row[0], m.row[1]);
  return (1 / dot(m.row[0], p)) * transposed({{p, q, s}});
}
/// The lower triangle L with L L^T = m. Condition: m is symmetric and positive definite.
TANDEM_HD inline Matrix3 cholesky(const Matrix3& m) {
  const double a = std::sqrt(m.row[0].x), b = m.row[1].x / a, c = m.row[2].x / a;
  const double d = std::sqrt(m.row[1].y - b * b), e = (m.row[2].y - b * c) / d;
  return {{{a, 0, 0}, {b, d, 0}, {c, e, std::sqrt(m.row[2].z - c * c - e * e)}}};
}

/// A rotation, as a unit quaternion.
struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;

  TANDEM_HD friend Quaternion operator*(const Quaternion& p, const Quaternion& q) {
    return {p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
            p.w * q.y + p.y * q.w + p.z * q.x - p.x * q.z, p.w * q.z + p.z * q.w + p.x * q.y - p.y * q.x};
  }
};

TANDEM_HD inline Quaternion conjugated(const Quaternion& q) {
  return {q.w, -q.x, -q.y, -q.z};
}
TANDEM_HD inline Quaternion normalized(const Quaternion& q) {
  const double size = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w / size, q.x / size, q.y / size, q.z / size};
}
TANDEM_HD inline Vector3 rotated(const Quaternion& q, const Vector3& p) {
  const Vector3 axis = {q.x, q.y, q.z}, twice = 2 * cross(axis, p);
  return p + q.w * twice + cross(axis, twice);
}
TANDEM_HD inline Matrix3 matrix_of(const Quaternion& q) {
  const double x = 2 * q.x, y = 2 * q.y, z = 2 * q.z;
  const double wx = x * q.w, wy = y * q.w, wz = z * q.w, xx = x * q.x, xy = y * q.x, xz = z * q.x,
               yy = y * q.y, yz = z * q.y, zz = z * q.z;
  return {{{1 - (yy + zz), xy - wz, xz + wy},
           {xy + wz, 1 - (xx + zz), yz - wx},
           {xz - wy, yz + wx, 1 - (xx + yy)}}};
}
/// Condition: the matrix is a rotation, nearly.
TANDEM_HD inline Quaternion quaternion_of(const double (&r)[3][3]) {
  const double t = r[0][0] + r[1][1] + r[2][2];
  Quaternion q;
  if (t > 0) {
    const double root = std::sqrt(t + 1), part = 0.5 / root;
    q = {0.5 * root, (r[2][1] - r[1][2]) * part, (r[0][2] - r[2][0]) * part, (r[1][0] - r[0][1]) * part};
  } else {
    int i = r[1][1] > r[0][0] ? 1 : 0;
    if (r[2][2] > r[i][i]) i = 2;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double root = std::sqrt(r[i][i] - r[j][j] - r[k][k] + 1), part = 0.5 / root;
    double axis[3];
    axis[i] = 0.5 * root, axis[j] = (r[j][i] + r[i][j]) * part, axis[k] = (r[k][i] + r[i][k]) * part;
    q = {(r[k][j] - r[j][k]) * part, axis[0], axis[1], axis[2]};
  }
  return normalized(q);
}
/// The turn by |angle| about the direction of `angle`.
TANDEM_HD inline Quaternion rotation_by(const Vector3& angle) {
  const double half = 0.5 * norm(angle);
  // sin(x) / x differs from 1 by less than half a unit in the last place.
  const double sine_over = half < 1e-9 ? 0.5 : 0.5 * std::sin(half) / half;
  return {std::cos(half), sine_over * angle.x, sine_over * angle.y, sine_over * angle.z};
}
/// The shortest rotation from one orientation to another, as an axis times an angle.
TANDEM_HD inline Vector3 turn_between(const Quaternion& from, const Quaternion& to) {
  const Quaternion turn = to * conjugated(from);
  const Vector3 axis = {turn.x, turn.y, turn.z};
  const double sine = norm(axis);
  if (!(sine > 0)) return {};
  const double angle = 2 * std::atan2(turn.w < 0 ? -sine : sine, std::fabs(turn.w));
  return (angle / sine) * axis;
}

inline constexpr double kPi = 3.14159265358979323846;

/// A velocity of a body and its spin, or what changes these.
struct Vector6 {
  Vector3 linear, angular;

  TANDEM_HD friend Vector6 operator+(const Vector6& p, const Vector6& q) {
    return {p.linear + q.linear, p.angular + q.angular};
  }
  TANDEM_HD friend Vector6 operator-(const Vector6& p, const Vector6& q) {
    return {p.linear - q.linear, p.angular - q.angular};
  }
  TANDEM_HD friend Vector6 operator*(double s, const Vector6& p) { return {s * p.linear, s * p.angular}; }
  TANDEM_HD Vector6 operator-() const { return {-linear, -angular}; }
  TANDEM_HD Vector6& operator+=(const Vector6& p) { return *this = *this + p; }
  TANDEM_HD Vector6& operator-=(const Vector6& p) { return *this = *this - p; }
};

TANDEM_HD inline double dot(const Vector6& p, const Vector6& q) {
  return dot(p.linear, q.linear) + dot(p.angular, q.angular);
}
TANDEM_HD inline double square(const Vector6& p) {
  return dot(p, p);
}

}  // namespace tandem::dynamics
