#pragma once
#include "kernels/geometry/level_error.h"
#include "tandem/kernels/tolerance_query.h"

/// The levels of detail that a query by tolerance looks at, and what follows, for CPU and GPU.
///
/// A pair is asked whether its levels are within clearance_of_levels(0, E_a, E_b), where E_a and E_b are
/// their posed_level_error(). If not, the finest surfaces do not meet: `apart`. If so, these are at most that
/// clearance and E_a + E_b more apart: less than 2 (1 + 2^-49) (E_a + E_b). Each level that is looked at has
/// E (4 + 2^-40) <= tolerance, or is the finest one, whose E is 0; so that is at most the tolerance:
/// `within_tolerance`. Where both are the finest levels, it was the contact query: `touching`.
///
/// Coarser levels first, for the pairs alone that these leave open, cost more than they spare: the upper
/// blocks of a tree tell apart what a coarser level could (docs/decisions/levels.md).
namespace tandem::levels {

/// The place of an asset's levels in the list of those of all assets, from the finest on.
struct LevelRange {
  std::uint32_t first, count;
};

/// The coarsest level that tells what is within the tolerance of a body that stands so. Levels have tree,
/// lower and upper, as a file's header has them; their errors ascend.
template <typename AnyLevel>
TANDEM_HD inline std::uint32_t level_within(const AnyLevel* levels, std::uint32_t count, const Pose& stored,
                                            double tolerance) {
  const auto tells = [&](const AnyLevel& level) {
    return posed_level_error(level.tree, level.lower, level.upper, stored) * (4 + 0x1p-40) <= tolerance;
  };
  std::uint32_t coarsest = 0;
  while (coarsest + 1 < count && tells(levels[coarsest + 1])) ++coarsest;
  return coarsest;
}

/// near: their levels were found to be within that clearance. An instance touches itself.
TANDEM_HD inline PairVerdict verdict_on(const ObjectPair& pair, std::uint32_t level_a, std::uint32_t level_b,
                                        bool near) {
  if (pair.a == pair.b) return {ToleranceVerdict::touching, 0, 0};
  const bool finest = level_a == 0 && level_b == 0;
  const ToleranceVerdict verdict = !near    ? ToleranceVerdict::apart
                                   : finest ? ToleranceVerdict::touching
                                            : ToleranceVerdict::within_tolerance;
  return {verdict, static_cast<std::uint8_t>(level_a), static_cast<std::uint8_t>(level_b)};
}

}  // namespace tandem::levels
