#pragma once
#include "tandem/formats/check.h"

namespace tandem {

/// The part of check() that is about the topology of one level. Condition: check_tree() found the rest of the
/// level sound; the level has topology, and its counts agree. seed: whatever the writer of a file cannot
/// choose, so that none can be made whose vertices all lie in one place of a hash table.
CheckResult check_topology(const LevelView& level, CheckDepth depth, std::uint64_t seed);

}  // namespace tandem
