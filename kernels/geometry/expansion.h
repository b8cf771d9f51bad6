#pragma once
#include <cmath>

#include "tandem/kernels/pose.h"

/// Exact signs of determinants by expansion arithmetic, for CPU and GPU. Source: Shewchuk, Adaptive Precision
/// Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997.
///
/// An expansion is a sum of float64 terms, ordered by magnitude, that do not overlap: its sign is that of its
/// largest term. Here zeros are left out, so no terms means zero. All functions need round to nearest even;
/// host code must be compiled with -ffp-contract=off, device code uses operations that are never contracted.
/// Keeps rarely needed code with large arrays out of line: a GPU reserves stack for every thread that could
/// be resident, and the compilers would copy it to each of dozens of calls.
#define TANDEM_OUT_OF_LINE [[gnu::noinline]]

namespace tandem::detail {

// Range in which every operation below is exact: coordinates that are zero or in
// [kSmallestInRange, kLargestInRange] in magnitude.
//
// Proof. A nonzero coordinate of at least 2^-306 is a multiple of 2^-358. Sums and differences of multiples
// of a power of two are multiples of it, and so is the rounding error of one. Hence terms of differences are
// multiples of 2^-358, terms of products of two of 2^-716, terms of products of three of 2^-1074: all terms,
// and all roundoffs, are float64 numbers, and nothing underflows, which is all that two_sum and two_product
// need from below. (Dekker's halves of x are multiples of x's unit, their products of the product's unit.)
// From above: differences stay within 2^339, minors within 2^679, the determinant within 6 * 2^1017 < 2^1020,
// rounding a partial sum adds less than a bit, and the multiplication by 2^27 + 1 in split() meets terms of
// minors at most.
inline constexpr double kSmallestInRange = 0x1p-306, kLargestInRange = 0x1p338;

TANDEM_HD inline double minus(double a, double b) {
#ifdef __CUDA_ARCH__
  return __dsub_rn(a, b);
#else
  return a - b;
#endif
}

/// high + low, exactly; high is the rounded result of an operation, low its roundoff.
struct Rounded {
  double high, low;
};

/// a + b (Knuth).
TANDEM_HD inline Rounded two_sum(double a, double b) {
  const double sum = plus(a, b);
  const double b_part = minus(sum, a);
  return {sum, plus(minus(a, minus(sum, b_part)), minus(b, b_part))};
}

/// a + b where |a| >= |b| (Dekker).
TANDEM_HD inline Rounded fast_two_sum(double a, double b) {
  const double sum = plus(a, b);
  return {sum, minus(b, minus(sum, a))};
}

/// a as two halves of 26 bits each (Dekker; Shewchuk, theorem 17).
TANDEM_HD inline Rounded split(double a) {
  const double shifted = times(0x1p27 + 1, a);
  const double high = minus(shifted, minus(shifted, a));
  return {high, minus(a, high)};
}

/// a * b (Shewchuk, theorem 18; with a fused operation the roundoff takes one step).
TANDEM_HD inline Rounded two_product(double a, double b) {
  const double product = times(a, b);
#if defined(__CUDA_ARCH__)
  return {product, __fma_rn(a, b, -product)};
#elif defined(FP_FAST_FMA)
  return {product, std::fma(a, b, -product)};
#else
  const Rounded x = split(a), y = split(b);
  const double rest =
      minus(minus(minus(product, times(x.high, y.high)), times(x.low, y.high)), times(x.high, y.low));
  return {product, minus(times(x.low, y.low), rest)};
#endif
}

/// Up to kCapacity nonzero terms, strongly nonoverlapping, in increasing order of magnitude.
template <int kCapacity>
struct Expansion {
  double term[kCapacity];
  int size;

  TANDEM_HD void clear() { size = 0; }
  TANDEM_HD void append(double value) {
    if (value != 0) term[size++] = value;
  }
};

/// Keeps the sign of what would be an expansion: of the last nonzero term appended.
struct LastSign {
  double last;

  TANDEM_HD void clear() { last = 0; }
  TANDEM_HD void append(double value) {
    if (value != 0) last = value;
  }
  TANDEM_HD int sign() const { return last > 0 ? 1 : last < 0 ? -1 : 0; }
};

/// Keeps what would be an expansion as one number of its sign, right to a few roundings.
struct RoundedSum {
  double sum, last;

  TANDEM_HD void clear() { sum = last = 0; }
  TANDEM_HD void append(double value) {
    sum = plus(sum, value);
    if (value != 0) last = value;
  }
  TANDEM_HD double value() const { return sum * last > 0 ? sum : last; }
};

TANDEM_HD inline void assign_difference(double a, double b, Expansion<2>& out) {
  const Rounded difference = two_sum(a, -b);
  out.clear();
  out.append(difference.low);
  out.append(difference.high);
}

/// e + f into out, which is neither: at most n + m terms, one for each step (fast-expansion-sum, Shewchuk,
/// theorem 13: strongly nonoverlapping operands give a strongly nonoverlapping sum). Zeros left out change no
/// step, because adding zero is exact.
template <int n, int m, class Out>
TANDEM_HD inline void assign_sum(const Expansion<n>& e, const Expansion<m>& f, Out& out) {
  out.clear();
  double sum = 0;
  for (int i = 0, j = 0; i < e.size || j < f.size;) {
    const bool take_e = j == f.size || (i < e.size && std::fabs(e.term[i]) < std::fabs(f.term[j]));
    const Rounded next = two_sum(sum, take_e ? e.term[i++] : f.term[j++]);
    out.append(next.low);
    sum = next.high;
  }
  out.append(sum);
}

/// e * b into out: at most 2n terms (scale-expansion, Shewchuk, theorem 19; keeps "strongly nonoverlapping").
template <int n>
TANDEM_HD inline void assign_scaled(const Expansion<n>& e, double b, Expansion<2 * n>& out) {
  out.clear();
  double sum = 0;
  for (int i = 0; i < e.size; ++i) {
    const Rounded product = two_product(e.term[i], b);
    const Rounded lower = two_sum(sum, product.low);
    const Rounded upper = fast_two_sum(product.high, lower.high);
    out.append(lower.low);
    out.append(upper.low);
    sum = upper.high;
  }
  out.append(sum);
}

/// e * f into out: at most 4n terms.
template <int n>
TANDEM_HD inline void assign_product(const Expansion<n>& e, const Expansion<2>& f, Expansion<4 * n>& out) {
  Expansion<2 * n> low, high;
  low.clear();
  high.clear();
  if (f.size > 0) assign_scaled(e, f.term[0], low);
  if (f.size > 1) assign_scaled(e, f.term[1], high);
  assign_sum(low, high, out);
}

/// u0 * v1 - u1 * v0 into out: 8 terms for each product, 16 for both.
template <class Out>
TANDEM_HD inline void assign_minor(const Expansion<2>& u0, const Expansion<2>& u1, const Expansion<2>& v0,
                                   const Expansion<2>& v1, Out& out) {
  Expansion<8> left, right;
  assign_product(u0, v1, left);
  assign_product(u1, v0, right);
  for (int i = 0; i < right.size; ++i) right.term[i] = -right.term[i];
  assign_sum(left, right, out);
}

TANDEM_HD inline bool in_range(const double* p) {
  bool all = true;
  for (int k = 0; k < 3; ++k) {
    const double size = std::fabs(p[k]);
    all = all && (size == 0 || (size >= kSmallestInRange && size <= kLargestInRange));
  }
  return all;
}

/// The vector from one point to another, exactly: the difference of two float64 numbers along each axis.
struct Between {
  const double* from;
  const double* to;
};

TANDEM_HD inline bool in_range(const Between& u) {
  return in_range(u.from) && in_range(u.to);
}

/// Assigns one of the three terms of a determinant: w[k] * (u[i] * v[j] - u[j] * v[i]) with (i, j, k) in
/// cyclic order. 16 terms in the minor, 4 * 16 in the product.
TANDEM_OUT_OF_LINE TANDEM_HD inline void assign_volume_term(const Between& u, const Between& v,
                                                            const Between& w, int k, Expansion<64>& out) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  Expansion<2> ui, uj, vi, vj, wk;
  assign_difference(u.to[i], u.from[i], ui);
  assign_difference(u.to[j], u.from[j], uj);
  assign_difference(v.to[i], v.from[i], vi);
  assign_difference(v.to[j], v.from[j], vj);
  assign_difference(w.to[k], w.from[k], wk);
  Expansion<16> minor;
  assign_minor(ui, uj, vi, vj, minor);
  assign_product(minor, wk, out);
}

/// Assigns det(u, v, w) for points in range. 64 terms for each of three products, 128 for two of them; the
/// last sum is not stored, but `out` learns its terms.
template <class Out>
TANDEM_HD inline void assign_volume(const Between& u, const Between& v, const Between& w, Out& out) {
  Expansion<128> two_terms;
  Expansion<64> x, y;
  assign_volume_term(u, v, w, 0, x);
  assign_volume_term(u, v, w, 1, y);
  assign_sum(x, y, two_terms);
  assign_volume_term(u, v, w, 2, x);
  assign_sum(two_terms, x, out);
}

/// Sign of det(u, v, w) for points in range.
TANDEM_OUT_OF_LINE TANDEM_HD inline int expansion_volume_sign(const Between& u, const Between& v,
                                                              const Between& w) {
  LastSign sum;
  assign_volume(u, v, w, sum);
  return sum.sign();
}

/// det(u, v, w) for points in range, rounded, with the exact sign.
TANDEM_OUT_OF_LINE TANDEM_HD inline double expansion_volume(const Between& u, const Between& v,
                                                            const Between& w) {
  RoundedSum sum;
  assign_volume(u, v, w, sum);
  return sum.value();
}

/// Sign of (q - p) x (r - p) seen along axis k, for points in range.
TANDEM_OUT_OF_LINE TANDEM_HD inline int expansion_area_sign(const double* p, const double* q, const double* r,
                                                            int k) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  Expansion<2> ui, uj, vi, vj;
  assign_difference(q[i], p[i], ui);
  assign_difference(q[j], p[j], uj);
  assign_difference(r[i], p[i], vi);
  assign_difference(r[j], p[j], vj);
  LastSign minor;
  assign_minor(ui, uj, vi, vj, minor);
  return minor.sign();
}

}  // namespace tandem::detail
