#pragma once
#include "tandem/formats/check.h"

/// The parts of check() that are about one level.
namespace tandem {

/// Proves that one level's blocks are a tree and that every box contains what is below it.
/// Condition: the level's pointers and counts are right and no count is zero.
CheckResult check_tree(const LevelView& level, std::uint64_t source_faces, std::span<const Part> parts);

/// Checks the oriented blocks of a level, and their order where it has one. Condition: check_tree() found the
/// rest of the level sound; the level has oriented blocks.
CheckResult check_oriented_blocks(const LevelView& level, CheckDepth depth);

/// Checks the topology of a level. Condition: check_tree() found the rest of the level sound; the level has
/// topology, and its counts agree. source_vertices: of the file. seed: whatever the writer of a file cannot
/// choose, so that none can be made whose vertices all lie in one place of a hash table.
CheckResult check_topology(const LevelView& level, CheckDepth depth, std::uint64_t source_vertices,
                           std::uint64_t seed);

}  // namespace tandem
