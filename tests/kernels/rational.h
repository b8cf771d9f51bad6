#pragma once
#include <CGAL/config.h>
#ifdef CGAL_USE_GMP
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Gmpq.h>
#else
#include <CGAL/Simple_cartesian.h>
#include <CGAL/boost_mp.h>
#endif

#include <array>

/// Exact arithmetic of the oracles.
namespace tandem {

/// Rational numbers: GMP's, or Boost's where there is no GMP, as in a build for Windows. The kernel has no
/// intervals there, because those of CGAL's own kernel overflow for large numbers. Share: see oracle_share().
#ifdef CGAL_USE_GMP
using Rational = CGAL::Gmpq;
using ExactKernel = CGAL::Exact_predicates_exact_constructions_kernel;
inline constexpr int kOracleShare = 1;
#else
using Rational = boost::multiprecision::cpp_rational;
using ExactKernel = CGAL::Simple_cartesian<Rational>;
inline constexpr int kOracleShare = 20;
#endif
using RationalPoint = std::array<Rational, 3>;

inline RationalPoint rational(const double* p) {
  return {Rational(p[0]), Rational(p[1]), Rational(p[2])};
}
inline RationalPoint operator-(const RationalPoint& p, const RationalPoint& q) {
  return {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
}
inline RationalPoint operator+(const RationalPoint& p, const RationalPoint& q) {
  return {p[0] + q[0], p[1] + q[1], p[2] + q[2]};
}
inline RationalPoint operator*(const Rational& f, const RationalPoint& p) {
  return {f * p[0], f * p[1], f * p[2]};
}
inline Rational dot(const RationalPoint& p, const RationalPoint& q) {
  return p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}
inline RationalPoint cross(const RationalPoint& p, const RationalPoint& q) {
  return {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
}

}  // namespace tandem
