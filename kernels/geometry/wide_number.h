#pragma once
#include <cmath>
#include <cstdint>

#include "kernels/geometry/wide_integer.h"

/// Whole numbers wide enough for polynomials in the differences of any finite float64 coordinates, for CPU
/// and GPU: what exact distances are made of.
namespace tandem::exact {

/// A whole number below 2^(32 kWords kDegree) in magnitude, of which only the words in use cost time. Results
/// are written in place: wide ones are too large for the stack of a GPU's threads.
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
  TANDEM_HD void assign_difference(double a, double b, int unit, int n) {
    for (int i = 0; i < n; ++i) word_[i] = 0;
    detail::accumulate(word_, n, a, unit, a < 0);
    detail::accumulate(word_, n, b, unit, !(b < 0));
    detail::normalise(word_, n, negative_);
    size_ = n;
    trim();
  }

  TANDEM_HD void assign(std::uint64_t significand) {
    static_assert(kCapacity >= 2);
    word_[0] = static_cast<std::uint32_t>(significand);
    word_[1] = static_cast<std::uint32_t>(significand >> 32);
    negative_ = false;
    size_ = 2;
    trim();
  }

  /// Neither factor is this number.
  template <int kX, int kY>
  TANDEM_HD void assign_product(const WideNumber<kWords, kX>& x, const WideNumber<kWords, kY>& y) {
    static_assert(kX + kY == kDegree);
    size_ = x.size_ == 0 || y.size_ == 0 ? 0 : x.size_ + y.size_;
    negative_ = x.negative_ != y.negative_;
    if (size_ == 0) return;
    for (int i = 0; i < size_; ++i) word_[i] = 0;
    for (int i = 0; i < x.size_; ++i) {
      std::uint64_t carry = 0;
      for (int j = 0; j < y.size_; ++j) {
        carry += std::uint64_t{x.word_[i]} * y.word_[j] + word_[i + j];
        word_[i + j] = static_cast<std::uint32_t>(carry);
        carry >>= 32;
      }
      word_[i + y.size_] = static_cast<std::uint32_t>(carry);
    }
    trim();
  }

  TANDEM_HD void add(const WideNumber& y) { add(y, y.negative_); }
  TANDEM_HD void subtract(const WideNumber& y) { add(y, !y.negative_); }
  TANDEM_HD void negate() { negative_ = !negative_; }

  TANDEM_HD int sign() const { return size_ == 0 ? 0 : negative_ ? -1 : 1; }
  TANDEM_HD int size() const { return size_; }
  TANDEM_HD std::uint32_t word(int i) const { return i < size_ ? word_[i] : 0; }

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

  TANDEM_HD void trim() {
    while (size_ > 0 && word_[size_ - 1] == 0) --size_;
  }

  /// y's magnitude, with a sign of choice.
  TANDEM_HD void add(const WideNumber& y, bool negative_y) {
    const bool alike = negative_ == negative_y, larger = compare_magnitudes(*this, y) >= 0;
    const int size = size_ < y.size_ ? y.size_ : size_;
    std::int64_t carry = 0;
    for (int i = 0; i < size; ++i) {
      const std::int64_t mine = word(i), other = y.word(i);
      carry += alike ? mine + other : larger ? mine - other : other - mine;
      word_[i] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    if (!larger) negative_ = negative_y;
    size_ = size;
    if (carry != 0) word_[size_++] = static_cast<std::uint32_t>(carry);
    trim();
  }

  std::uint32_t word_[kCapacity];  ///< size_ of them, the least significant first, the last one not 0
  int size_;
  bool negative_;
};

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
