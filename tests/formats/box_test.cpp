#include "tandem/formats/box.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

namespace tandem {
namespace {

// long double has 64 bits; sums of two floats are exact in it where their exponents differ by at most 40. The
// reference below therefore adds integers: every float is a multiple of 2^-149, and 2^128 of them fit into
// 300 bits.
class Exact {
 public:
  explicit Exact(float x) {
    const int sign = std::signbit(x) ? -1 : 1;
    int exponent = 0;
    const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(std::fabs(x), &exponent), 24));
    const int shift = exponent - 24 + 149;  // of the mantissa, at least -24 for denormals
    for (int bit = 0; bit < 24; ++bit) {
      if ((mantissa >> bit & 1) != 0)
        digits_[(shift + bit) / 16] += sign * (std::int64_t{1} << (shift + bit) % 16);
    }
  }
  Exact operator+(const Exact& other) const { return combine(other, 1); }
  Exact operator-(const Exact& other) const { return combine(other, -1); }
  int sign() const {
    std::int64_t digits[kDigits], carry = 0;
    for (int i = 0; i < kDigits; ++i) {
      const std::int64_t sum = digits_[i] + carry;
      carry = sum >> 16;
      digits[i] = sum - (carry << 16);
    }
    if (carry < 0) return -1;
    for (const std::int64_t digit : digits) {
      if (digit != 0) return 1;
    }
    return carry > 0 ? 1 : 0;
  }

 private:
  static constexpr int kDigits = 20;
  Exact combine(const Exact& other, int factor) const {
    Exact result = *this;
    for (int i = 0; i < kDigits; ++i) result.digits_[i] += factor * other.digits_[i];
    return result;
  }
  std::int64_t digits_[kDigits] = {};
};

bool within(float c_i, float h_i, float c, float h) {
  const Exact low_inside = (Exact(c_i) - Exact(h_i)) - (Exact(c) - Exact(h));
  const Exact high_inside = (Exact(c) + Exact(h)) - (Exact(c_i) + Exact(h_i));
  return low_inside.sign() >= 0 && high_inside.sign() >= 0;
}

// Floats of all magnitudes up to the limit, denormals and zeros, often close to one another.
float any_float(std::mt19937_64& random) {
  switch (random() % 6) {
    case 0:
      return 0.0f;
    case 1:
      return std::bit_cast<float>(static_cast<std::uint32_t>(random() & 0x807FFFFFu));  // denormal
    case 2:
      return std::ldexp(1.0f, static_cast<int>(random() % 250) - 125);
    case 3:
      return (random() % 2 == 0 ? 1.0f : -1.0f) * kMaxCoordinate;
    case 4:
      return 1.0f + static_cast<float>(random() % 16) * 0x1p-23f;
    default: {
      const float x = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
      return std::fabs(x) <= kMaxCoordinate ? x : 1.0f;
    }
  }
}

TEST(Enclose, ContainsBothPointsAndNoSmallerFloatWould) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 200000; ++i) {
    float a = any_float(random), b = any_float(random);
    if (a > b) std::swap(a, b);
    const Box box = enclose({a, a, a}, {b, b, b});
    const float c = box.center[1], h = box.half_extent[1];
    ASSERT_TRUE(std::isfinite(c) && std::isfinite(h));
    ASSERT_TRUE(within(a, 0, c, h) && within(b, 0, c, h)) << a << " " << b;
    if (h > 0) {
      const float smaller = std::nextafter(h, 0.0f);
      ASSERT_FALSE(within(a, 0, c, smaller) && within(b, 0, c, smaller)) << a << " " << b;
    }
  }
}

TEST(Enclose, ABlocksBoxContainsItsNodesAndNoSmallerFloatWould) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 100000; ++i) {
    Block block;
    const int real = 1 + static_cast<int>(random() % 4);
    for (int n = 0; n < 4; ++n) {
      float a = any_float(random), b = any_float(random);
      if (a > b) std::swap(a, b);
      if (n < real) set_node(block, n, enclose({a, a, a}, {b, b, b}), n, NodeKind::leaf);
      if (n >= real) set_imaginary(block, n);
    }
    const Box box = enclose(block);
    const float c = box.center[2], h = box.half_extent[2];
    ASSERT_TRUE(std::isfinite(h));
    bool smaller_would_do = h > 0;
    for (int n = 0; n < real; ++n) {
      ASSERT_TRUE(within(block.center[2][n], block.half_extent[2][n], c, h)) << i;
      smaller_would_do =
          smaller_would_do && within(block.center[2][n], block.half_extent[2][n], c, std::nextafter(h, 0.0f));
    }
    ASSERT_FALSE(smaller_would_do) << i;
  }
}

TEST(Contains, AgreesWithIntegerArithmetic) {
  std::mt19937_64 random(6);
  int inside = 0, outside = 0;
  for (int i = 0; i < 300000; ++i) {
    const float c = any_float(random), h = std::fabs(any_float(random)), c_i = any_float(random);
    float h_i = std::fabs(any_float(random));
    if (random() % 2 == 0)
      h_i = std::nextafter(std::fabs(h - std::fabs(c_i - c)),
                           random() % 2 == 0 ? 0.0f : 1e30f);  // nearly touching
    if (!std::isfinite(h_i)) continue;
    const Box outer = {{c, c, c}, {h, h, h}}, inner = {{c_i, c_i, c_i}, {h_i, h_i, h_i}};
    const bool expected = within(c_i, h_i, c, h);
    ASSERT_EQ(contains(outer, inner), expected) << c << " " << h << " " << c_i << " " << h_i;
    ASSERT_EQ(contains(outer, {c_i, c_i, c_i}), within(c_i, 0, c, h));
    (expected ? inside : outside)++;
  }
  EXPECT_GT(inside, 10000);
  EXPECT_GT(outside, 10000);
}

// 64 levels of boxes around boxes at the limit of the coordinates, each pushed as far out as rounding allows.
TEST(Enclose, StaysFiniteAtTheDeepestTreeOfTheLargestCoordinates) {
  const float m = kMaxCoordinate;
  Box box = enclose({-m, -m, -m}, {m, std::nextafter(m, 0.0f), m});
  for (std::uint32_t depth = 0; depth < kMaxDepth; ++depth) {
    Block block;
    set_node(block, 0, box, 1, NodeKind::internal);
    const float near = std::nextafter(m, 0.0f);
    set_node(block, 1, enclose({-near, -near, -m}, {m, m, near}), 2, NodeKind::internal);
    for (int n = 2; n < 4; ++n) set_imaginary(block, n);
    box = enclose(block);
    for (const float h : box.half_extent) ASSERT_TRUE(std::isfinite(h)) << depth;
  }
}

}  // namespace
}  // namespace tandem
