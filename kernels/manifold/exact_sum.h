#pragma once
#include <bit>
#include <cstdint>

#include "tandem/kernels/detail/vector3.h"

namespace tandem::manifold {

/// A sum that does not depend on the order of its terms: whole multiples of 2^-30 and of 2^-60 of a unit are
/// added up in integers. Terms of at most 2^0.5 units are rounded to 2^-60 units; 2^31 of them fit.
struct ExactSum {
  std::int64_t upper = 0, lower = 0;

  /// Adds value / unit. one_by_unit: a power of two.
  TANDEM_HD void add(double value, double one_by_unit) {
    const double scaled = value * one_by_unit * 0x1p30;
    double whole = 0, rest = 0;
    upper += whole_number(scaled, whole);
    lower += whole_number((scaled - whole) * 0x1p30, rest);
  }
  TANDEM_HD static std::int64_t bits_of(double x) {
#ifdef __CUDA_ARCH__
    return __double_as_longlong(x);
#else
    return std::bit_cast<std::int64_t>(x);
#endif
  }

  /// The nearest whole number. The sum with 1.5 * 2^52 is rounded to a whole number, which is in its last
  /// bits. Condition: at most 2^51.
  TANDEM_HD static std::int64_t whole_number(double x, double& whole) {
    constexpr double kMagic = 0x1.8p52;
    const double sum = x + kMagic;
    whole = sum - kMagic;
    return bits_of(sum) - bits_of(kMagic);
  }

  TANDEM_HD double value(double unit) const {
    return (static_cast<double>(upper) + static_cast<double>(lower) * 0x1p-30) * (0x1p-30 * unit);
  }
};

struct ExactVectorSum {
  ExactSum x, y, z;

  TANDEM_HD void add(const Vector3& value, double one_by_unit) {
    x.add(value.x, one_by_unit);
    y.add(value.y, one_by_unit);
    z.add(value.z, one_by_unit);
  }
  TANDEM_HD Vector3 value(double unit) const { return {x.value(unit), y.value(unit), z.value(unit)}; }
};

/// Makes each of these the sum of all that a team has.
template <typename Team, typename... Sums>
TANDEM_HD void add_up(const Team& team, Sums&... sums) {
  std::int64_t words[] = {sums.upper..., sums.lower...};
  team.sums(words);
  int i = 0;
  ((sums.upper = words[i++]), ...);
  ((sums.lower = words[i++]), ...);
}

}  // namespace tandem::manifold
