#pragma once
#include "tandem/formats/check.h"

namespace tandem {

/// Proves that one level's blocks are a tree and that every box contains what is below it.
/// Condition: the level's pointers and counts are right and no count is zero.
CheckResult check_tree(const LevelView& level, std::uint64_t source_faces, std::span<const Part> parts);

}  // namespace tandem
