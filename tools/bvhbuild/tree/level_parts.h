#pragma once
#include <optional>
#include <vector>

#include "assemble.h"
#include "tandem/build/build_options.h"

namespace tandem::build {

/// The tree of a level and what belongs to it.
struct LevelParts {
  Tree tree;
  std::vector<OrientedBlock> oriented_blocks;
  std::optional<SurfaceTopology> topology;
};

/// Builds what the options ask for, as far as there are not too many triangles for it. The result does not
/// depend on the number of threads.
LevelParts build_parts(const Geometry& geometry, const BuildOptions& options, OptimisationWatch& watch);

/// Assembles a file and has the checker prove it: what is written, every program can load. Throws
/// std::bad_alloc, and std::logic_error on a defect of the program.
CheckedImage assemble_checked(const AssetSource& source, std::span<const AssetLevel> levels);

}  // namespace tandem::build
