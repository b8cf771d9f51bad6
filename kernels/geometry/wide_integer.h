#pragma once
#include <bit>
#include <cstdint>

#include "kernels/geometry/expansion.h"

/// Exact signs of determinants of any finite float64 points, by integers wide enough for all of them, for CPU
/// and GPU. They decide what lies outside the range of tandem/kernels/detail/expansion.h: coordinates beyond
/// 2^338 or below 2^-306, or both at once, where no scaling helps.
///
/// Size. Every finite float64 is an integer below 2^53 times 2^e with -1074 <= e <= 971. Over the smallest e
/// of the coordinates at hand ("unit"), a coordinate is an integer below 2^(span + 53), where span <= 2045 is
/// the largest e less the smallest; a difference is below 2^(span + 54), and a determinant of them is below
/// 6 * 2^(3 span + 162) < 2^(3 span + 165). With a sign that is 3 span + 166 bits, which 3n words of 32 bits
/// hold if 32n >= span + 56; n <= 66.
namespace tandem::detail {

inline constexpr int kMaxWords = 66;

/// An integer of a sign and size words, least significant first.
template <int kCapacity>
struct Wide {
  std::uint32_t word[kCapacity];
  bool negative;
};

/// significand * 2^exponent, the magnitude of a float64.
struct Magnitude {
  std::uint64_t significand;
  int exponent;
};

TANDEM_HD inline std::uint64_t bits_of(double x) {
#ifdef __CUDA_ARCH__
  return static_cast<std::uint64_t>(__double_as_longlong(x));
#else
  return std::bit_cast<std::uint64_t>(x);
#endif
}

TANDEM_HD inline double float64_of(std::uint64_t bits) {
#ifdef __CUDA_ARCH__
  return __longlong_as_double(static_cast<long long>(bits));
#else
  return std::bit_cast<double>(bits);
#endif
}

TANDEM_HD inline Magnitude magnitude(double x) {
  const std::uint64_t bits = bits_of(x);
  const std::uint64_t fraction = bits & ((std::uint64_t{1} << 52) - 1);
  const int biased = static_cast<int>((bits >> 52) & 0x7FF);
  if (biased == 0) return {fraction, -1074};
  return {fraction | (std::uint64_t{1} << 52), biased - 1075};
}

/// The exponent of a coordinate's last bit, smallest and largest over the nonzero ones.
struct ExponentRange {
  int unit = 1024;
  int largest = -1074;

  TANDEM_HD void include(double x) {
    if (x == 0) return;
    const int e = magnitude(x).exponent;
    if (e < unit) unit = e;
    if (e > largest) largest = e;
  }
  /// n of the comment above; 1 if all coordinates are zero.
  TANDEM_HD int words() const { return unit > largest ? 1 : (largest - unit + 56 + 31) / 32; }
};

/// sum += or -= x * 2^(32 * offset), modulo 2^(32n); x has m words, offset + m <= n.
TANDEM_HD inline void accumulate(std::uint32_t* sum, int n, const std::uint32_t* x, int m, int offset,
                                 bool subtract) {
  std::uint32_t carry = subtract ? 1 : 0;
  for (int i = offset; i < n; ++i) {
    const std::uint32_t word = i - offset < m ? x[i - offset] : 0;
    const std::uint64_t next = std::uint64_t{sum[i]} + (subtract ? ~word : word) + carry;
    sum[i] = static_cast<std::uint32_t>(next);
    carry = static_cast<std::uint32_t>(next >> 32);
  }
}

/// sum += or -= |x| / 2^unit, modulo 2^(32n). The significand, shifted by less than a word, fits three words.
TANDEM_HD inline void accumulate(std::uint32_t* sum, int n, double x, int unit, bool subtract) {
  if (x == 0) return;
  const Magnitude m = magnitude(x);
  const int shift = m.exponent - unit;
  const int bit = shift % 32;
  const std::uint64_t low = m.significand << bit;
  const std::uint64_t high = bit == 0 ? 0 : m.significand >> (64 - bit);
  const std::uint32_t words[3] = {static_cast<std::uint32_t>(low), static_cast<std::uint32_t>(low >> 32),
                                  static_cast<std::uint32_t>(high)};
  const int left = n - shift / 32;
  accumulate(sum, n, words, left < 3 ? left : 3, shift / 32, subtract);
}

/// Two's complement to sign and magnitude.
TANDEM_HD inline void normalise(std::uint32_t* word, int n, bool& negative) {
  negative = (word[n - 1] >> 31) != 0;
  if (!negative) return;
  std::uint32_t carry = 1;
  for (int i = 0; i < n; ++i) {
    word[i] = ~word[i] + carry;
    carry = carry != 0 && word[i] == 0 ? 1 : 0;
  }
}

TANDEM_HD inline void assign_difference(double a, double b, int unit, int n, Wide<kMaxWords>& out) {
  for (int i = 0; i < n; ++i) out.word[i] = 0;
  accumulate(out.word, n, a, unit, a < 0);
  accumulate(out.word, n, b, unit, !(b < 0));
  normalise(out.word, n, out.negative);
}

/// x * y into out; x has n words, y has m, out n + m.
template <int kX, int kY>
TANDEM_HD inline void assign_product(const Wide<kX>& x, int n, const Wide<kY>& y, int m, Wide<kX + kY>& out) {
  for (int i = 0; i < n + m; ++i) out.word[i] = 0;
  for (int i = 0; i < n; ++i) {
    std::uint64_t carry = 0;
    for (int j = 0; j < m; ++j) {
      carry += std::uint64_t{x.word[i]} * y.word[j] + out.word[i + j];
      out.word[i + j] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    out.word[i + m] = static_cast<std::uint32_t>(carry);
  }
  out.negative = x.negative != y.negative;
}

TANDEM_HD inline int sign_of(const std::uint32_t* word, int n) {
  if ((word[n - 1] >> 31) != 0) return -1;
  for (int i = 0; i < n; ++i) {
    if (word[i] != 0) return 1;
  }
  return 0;
}

/// Sign of det(u, v, w): six products of three differences.
TANDEM_OUT_OF_LINE TANDEM_HD inline int wide_volume_sign(const Between& u, const Between& v,
                                                         const Between& w) {
  ExponentRange range;
  for (int k = 0; k < 3; ++k) {
    range.include(u.from[k]);
    range.include(u.to[k]);
    range.include(v.from[k]);
    range.include(v.to[k]);
    range.include(w.from[k]);
    range.include(w.to[k]);
  }
  const int n = range.words(), unit = range.unit;
  Wide<kMaxWords> x, y;
  Wide<2 * kMaxWords> xy;
  Wide<3 * kMaxWords> xyz;
  std::uint32_t sum[3 * kMaxWords] = {};
  for (int term = 0; term < 6; ++term) {
    const bool odd = term >= 3;
    const int k = term % 3, i = (k + (odd ? 2 : 1)) % 3, j = (k + (odd ? 1 : 2)) % 3;
    assign_difference(u.to[i], u.from[i], unit, n, x);
    assign_difference(v.to[j], v.from[j], unit, n, y);
    assign_product(x, n, y, n, xy);
    assign_difference(w.to[k], w.from[k], unit, n, x);
    assign_product(xy, 2 * n, x, n, xyz);
    accumulate(sum, 3 * n, xyz.word, 3 * n, 0, xyz.negative != odd);
  }
  return sign_of(sum, 3 * n);
}

/// Sign of (q - p) x (r - p) seen along axis k.
TANDEM_OUT_OF_LINE TANDEM_HD inline int wide_area_sign(const double* p, const double* q, const double* r,
                                                       int k) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  ExponentRange range;
  for (int m = 1; m < 3; ++m) {
    range.include(p[(k + m) % 3]);
    range.include(q[(k + m) % 3]);
    range.include(r[(k + m) % 3]);
  }
  const int n = range.words(), unit = range.unit;
  Wide<kMaxWords> x, y;
  Wide<2 * kMaxWords> xy;
  std::uint32_t sum[2 * kMaxWords] = {};
  for (int term = 0; term < 2; ++term) {
    assign_difference(q[term == 0 ? i : j], p[term == 0 ? i : j], unit, n, x);
    assign_difference(r[term == 0 ? j : i], p[term == 0 ? j : i], unit, n, y);
    assign_product(x, n, y, n, xy);
    accumulate(sum, 2 * n, xy.word, 2 * n, 0, xy.negative != (term == 1));
  }
  return sign_of(sum, 2 * n);
}

}  // namespace tandem::detail
