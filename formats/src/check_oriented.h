#pragma once
#include "tandem/formats/check.h"

namespace tandem {

/// The part of check() that is about the oriented blocks of one level. Condition: check_tree() found the rest
/// of the level sound; the level has oriented blocks.
CheckResult check_oriented_blocks(const LevelView& level, CheckDepth depth);

}  // namespace tandem
