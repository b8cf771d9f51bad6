#pragma once
#include "tandem/kernels/detail/level_error.h"
#include "tandem/kernels/tolerance_query.h"

/// How rounds at finer and finer levels of detail come to verdicts, for CPU and GPU.
///
/// A round asks each pair that is still open whether its levels are within clearance_of_levels(0, E_a, E_b),
/// where E_a and E_b are their posed_level_error(). If not, the finest surfaces do not meet: `apart`. If so,
/// and both bodies are at their last level, the finest surfaces are at most that clearance and E_a + E_b more
/// apart: less than 2 (1 + 2^-49) (E_a + E_b). Each last level has E (4 + 2^-40) <= tolerance, or is the
/// finest one, whose E is 0; so that is at most the tolerance: `within_tolerance`. Where both are the finest
/// levels, the round was the contact query: `touching`.
namespace tandem::levels {

/// Where the levels of an asset lie in the list of those of all assets, from the finest on.
struct LevelRange {
  std::uint32_t first, count;
};

/// The coarsest level that tells what is within the tolerance of a body that stands so. Levels have tree,
/// lower and upper, as a file's header has them; their errors ascend.
template <typename AnyLevel>
TANDEM_HD inline std::uint32_t last_level(const AnyLevel* levels, std::uint32_t count, const Pose& stored,
                                          double tolerance) {
  const auto tells = [&](const AnyLevel& level) {
    return posed_level_error(level.tree, level.lower, level.upper, stored) * (4 + 0x1p-40) <= tolerance;
  };
  std::uint32_t last = 0;
  while (last + 1 < count && tells(levels[last + 1])) ++last;
  return last;
}

/// The level of a body in a round: a finer one in each, down to its last one.
TANDEM_HD inline std::uint32_t level_in_round(std::uint32_t count, std::uint32_t last, std::uint32_t round) {
  const std::uint32_t coarsest = count - 1;
  return round < coarsest - last ? coarsest - round : last;
}

/// The verdict on a pair whose last levels were found to be within clearance.
TANDEM_HD inline ToleranceVerdict verdict_on_near(std::uint32_t level_a, std::uint32_t level_b) {
  return level_a == 0 && level_b == 0 ? ToleranceVerdict::touching : ToleranceVerdict::within_tolerance;
}

}  // namespace tandem::levels
