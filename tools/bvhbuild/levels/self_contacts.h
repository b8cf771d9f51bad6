#pragma once
#include <cstdint>
#include <optional>

#include "tandem/formats/view.h"

namespace tandem::build {

/// Self-contacts are counted up to here.
inline constexpr std::uint64_t kMostSelfContacts = 1'000'000;

/// Returns how many pairs of triangles of a level meet without having a corner's position in common: the
/// surface goes through or touches itself there. As exact arithmetic on the stored coordinates finds it. None
/// where there are more than `most`, or where so many boxes of triangles overlap that looking at all pairs
/// would take time quadratic in the triangles. Keeps no pair in memory.
std::optional<std::uint64_t> count_self_contacts(const LevelView& level,
                                                 std::uint64_t most = kMostSelfContacts);

}  // namespace tandem::build
