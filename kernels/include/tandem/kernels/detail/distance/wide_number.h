#pragma once
#include <cmath>
#include <cstdint>

#include "tandem/kernels/detail/wide_integer.h"

/// Whole numbers wide enough for polynomials in the differences of any finite float64 coordinates, for CPU
/// and GPU: what exact distances are made of.
namespace tandem::exact {

/// A whole number below 2^(32 kWords kDegree) in magnitude, of which only the words in use cost time.
///
/// Size. Over the smallest exponent of the coordinates at hand ("unit"), a difference of two coordinates is
/// below 2^(span + 54), and ExponentRange::words() gives the n for which 32 n >= span + 56 (proof in
/// wide_integer.h; n <= detail::kMaxWords). A sum of up to 2^(2 d) products of d differences each is then
/// below 2^(d (span + 54) + 2 d) <= 2^(32 n d): it fits in n d words.
template <int kWords, int kDegree>
class WideNumber {
 public:
  static constexpr int kCapacity = kWords * kDegree;

  TANDEM_HD WideNumber() : size_(0), negative_(false) {}
  TANDEM_HD WideNumber(const WideNumber& other) : size_(0), negative_(false) { *this = other; }
  TANDEM_HD WideNumber& operator=(const WideNumber& other) {
    size_ = other.size_;
    negative_ = other.negative_;
    for (int i = 0; i < size_; ++i) word_[i] = other.word_[i];
    return *this;
  }

  /// (a - b) / 2^unit, which is a whole number; n words are enough.
  TANDEM_HD static WideNumber difference(double a, double b, int unit, int n) {
    WideNumber out;
    for (int i = 0; i < n; ++i) out.word_[i] = 0;
    detail::accumulate(out.word_, n, a, unit, a < 0);
    detail::accumulate(out.word_, n, b, unit, !(b < 0));
    detail::normalise(out.word_, n, out.negative_);
    out.size_ = n;
    out.trim();
    return out;
  }

  TANDEM_HD int sign() const { return size_ == 0 ? 0 : negative_ ? -1 : 1; }
  TANDEM_HD int size() const { return size_; }
  TANDEM_HD std::uint32_t word(int i) const { return i < size_ ? word_[i] : 0; }

  TANDEM_HD WideNumber operator-() const {
    WideNumber out = *this;
    out.negative_ = !negative_;
    return out;
  }

  TANDEM_HD friend WideNumber operator+(const WideNumber& x, const WideNumber& y) {
    return sum(x, y, y.negative_);
  }
  TANDEM_HD friend WideNumber operator-(const WideNumber& x, const WideNumber& y) {
    return sum(x, y, !y.negative_);
  }

  /// The sign of |x| - |y|.
  TANDEM_HD static int compare_magnitudes(const WideNumber& x, const WideNumber& y) {
    if (x.size_ != y.size_) return x.size_ < y.size_ ? -1 : 1;
    for (int i = x.size_ - 1; i >= 0; --i) {
      if (x.word_[i] != y.word_[i]) return x.word_[i] < y.word_[i] ? -1 : 1;
    }
    return 0;
  }

 private:
  template <int, int>
  friend class WideNumber;
  template <int kW, int kX, int kY>
  TANDEM_HD friend WideNumber<kW, kX + kY> operator*(const WideNumber<kW, kX>& x,
                                                     const WideNumber<kW, kY>& y);

  TANDEM_HD void trim() {
    while (size_ > 0 && word_[size_ - 1] == 0) --size_;
  }

  /// x, and y's magnitude with a sign of choice.
  TANDEM_HD static WideNumber sum(const WideNumber& x, const WideNumber& y, bool negative_y) {
    const bool add = x.negative_ == negative_y;
    const bool x_larger = compare_magnitudes(x, y) >= 0;
    const WideNumber &more = x_larger ? x : y, &less = x_larger ? y : x;
    WideNumber out;
    out.negative_ = x_larger ? x.negative_ : negative_y;
    std::int64_t carry = 0;
    for (int i = 0; i < more.size_; ++i) {
      const std::int64_t other = less.word(i);
      carry += static_cast<std::int64_t>(more.word_[i]) + (add ? other : -other);
      out.word_[i] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    out.size_ = more.size_;
    if (carry != 0) out.word_[out.size_++] = static_cast<std::uint32_t>(carry);
    out.trim();
    return out;
  }

  std::uint32_t word_[kCapacity];  ///< size_ of them, the least significant first, the last one not 0
  int size_;
  bool negative_;
};

template <int kW, int kX, int kY>
TANDEM_HD WideNumber<kW, kX + kY> operator*(const WideNumber<kW, kX>& x, const WideNumber<kW, kY>& y) {
  WideNumber<kW, kX + kY> out;
  if (x.size_ == 0 || y.size_ == 0) return out;
  out.size_ = x.size_ + y.size_;
  out.negative_ = x.negative_ != y.negative_;
  for (int i = 0; i < out.size_; ++i) out.word_[i] = 0;
  for (int i = 0; i < x.size_; ++i) {
    std::uint64_t carry = 0;
    for (int j = 0; j < y.size_; ++j) {
      carry += std::uint64_t{x.word_[i]} * y.word_[j] + out.word_[i + j];
      out.word_[i + j] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    out.word_[i + y.size_] = static_cast<std::uint32_t>(carry);
  }
  out.trim();
  return out;
}

/// lower * 2^exponent <= a number's magnitude <= upper * 2^exponent; the exponent is even, lower is in
/// [1, 4), and upper is larger by at most a factor of 1 + 2^-52; or all are 0.
struct Scaled {
  double lower, upper;
  int exponent;
};

template <int kWords, int kDegree>
TANDEM_HD inline Scaled scaled(const WideNumber<kWords, kDegree>& x) {
  if (x.size() == 0) return {0, 0, 0};
  const int top = x.size() - 1;
  std::uint64_t bits = std::uint64_t{x.word(top)} << 32 | (top > 0 ? x.word(top - 1) : 0);
  std::uint32_t below = top > 1 ? x.word(top - 2) : 0;
  int exponent = 32 * (top - 1);  // of the last of the 64 bits
  for (; bits >> 63 == 0; below <<= 1) {
    bits = bits << 1 | below >> 31;
    --exponent;
  }
  const std::uint64_t leading = bits >> 11;  // 53 bits, which a float64 takes, and so it does one more
  exponent += 11 + 52;
  const double unit = (exponent & 1) != 0 ? 0x1p-51 : 0x1p-52;
  return {static_cast<double>(leading) * unit, static_cast<double>(leading + 1) * unit, exponent & ~1};
}

}  // namespace tandem::exact
