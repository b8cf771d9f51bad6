#pragma once
#include <cstdint>

#include "tandem/kernels/detail/manifold/vector3.h"

namespace tandem::manifold {

/// A sum that does not depend on the order of its terms: whole multiples of 2^-30 and of 2^-60 of a unit are
/// added up in integers. Terms of at most 2^0.5 units are rounded to 2^-60 units; 2^31 of them fit.
struct ExactSum {
  std::int64_t upper = 0, lower = 0;

  /// Adds value / unit. one_by_unit: a power of two.
  TANDEM_HD void add(double value, double one_by_unit) {
    const double scaled = value * one_by_unit * 0x1p30;
    const double whole = std::rint(scaled);
    upper += static_cast<std::int64_t>(whole);
    lower += static_cast<std::int64_t>(std::rint((scaled - whole) * 0x1p30));
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

}  // namespace tandem::manifold
