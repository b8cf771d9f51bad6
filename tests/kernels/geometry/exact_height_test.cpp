#include "kernels/geometry/exact_height.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tandem {
namespace {

// Heights of whole numbers whose products cancel all but wholly, against arithmetic on 128 bits.
TEST(ExactHeight, HoldsTheExactValueAndIsNarrow) {
  __extension__ using Wide = __int128;
  std::mt19937_64 random(7);
  const auto any = [&](int bits) {
    const auto x = static_cast<std::int64_t>(random() >> (64 - bits));
    return random() % 2 == 0 ? x : -x;
  };
  for (int trial = 0; trial < 100'000; ++trial) {
    const std::int64_t n[3] = {any(52), any(52), any(1 + trial % 52)};
    const std::int64_t x[3] = {any(52), any(1 + trial % 50), any(52)};
    Wide sum = 0;
    for (int k = 0; k < 3; ++k) sum += Wide{n[k]} * x[k];
    const auto c = static_cast<double>(sum);
    const auto rest = static_cast<std::int64_t>(sum - static_cast<Wide>(c));  // of rounding c: below 2^53
    // Powers of two move both ends alike.
    const int shift = trial % 600 - 300;
    const double scale = std::ldexp(1.0, shift);
    const distance::Point<double> direction = {
        {static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2])}};
    const double point[3] = {static_cast<double>(x[0]) * scale, static_cast<double>(x[1]) * scale,
                             static_cast<double>(x[2]) * scale};
    const distance::Height height = distance::height_along(direction, point, c * scale);
    const double exact = static_cast<double>(rest) * scale;
    EXPECT_LE(height.low, exact);
    EXPECT_GE(height.high, exact);
    const double size = (std::fabs(c) + 0x1p106) * scale;
    EXPECT_LE(height.high - height.low, 0x1p-49 * std::fabs(exact) + 0x1p-97 * size);
  }
}

TEST(ExactHeight, KnowsNothingOfWhatIsTooLarge) {
  const double far[3] = {1e300, -1e300, 1};
  const distance::Height height = distance::height_along({{1, 1, 1}}, far, 0);
  EXPECT_EQ(height.low, -INFINITY);
  EXPECT_EQ(height.high, INFINITY);
  const distance::Direction none = distance::direction_along({{0, 0, 0}}, far);
  EXPECT_EQ(distance::distance_of_heights(none, 2, 1), 0);
}

}  // namespace
}  // namespace tandem
