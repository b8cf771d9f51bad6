#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "surface_topology.h"
#include "tandem/build/build_options.h"
#include "tandem/build/image.h"
#include "tandem/build/mesh.h"
#include "tandem/formats/oriented_block.h"
#include "tree.h"

namespace tandem::build {

/// A level of detail to be written: the triangles with the source face of each, and the tree over them.
struct AssetLevel {
  Geometry geometry;
  std::span<const std::uint32_t> face;
  const Tree* tree = nullptr;
  std::span<const OrientedBlock> oriented_blocks;  ///< of the tree; may be empty
  double error_bound = 0;
  const SurfaceTopology* topology = nullptr;  ///< of the tree, or null: the level has none
  /// The source vertex of each point of the geometry, ascending. The file gets those of the topology's
  /// vertices, and the order of oriented blocks. Empty: the level cannot be refitted.
  std::span<const std::uint32_t> source_vertex{};

  bool can_be_refitted() const { return topology != nullptr && !source_vertex.empty(); }
};

/// Everything else that a file holds.
struct AssetSource {
  std::array<double, 3> origin{};
  double rounding_error = 0;
  std::uint64_t source_faces = 0;
  std::uint64_t source_vertices = 0;  ///< more than every source vertex of a level
  std::span<const SourcePart> parts;  ///< ascending, without gaps, together source_faces faces
  std::string provenance;             ///< JSON
};

/// Lays a file out, fills it in and seals it with its hash. Throws std::bad_alloc, and std::logic_error
/// should the bytes written differ from the bytes planned. Condition: 1 to kMaxLevels levels, each with at
/// least one triangle; faces of triangles lie in parts.
Image assemble(const AssetSource& source, std::span<const AssetLevel> levels);

/// The tree of a level and what belongs to it.
struct LevelParts {
  Tree tree;
  std::vector<OrientedBlock> oriented_blocks;
  std::optional<SurfaceTopology> topology;
};

/// Builds what the options ask for, as far as there are not too many triangles for it. Vertices that lie
/// together and part in a pose stay apart only where the tree can be refitted: other files may not have such.
/// The result does not depend on the number of threads.
LevelParts build_parts(const Geometry& geometry, const BuildOptions& options, OptimisationWatch& watch);

/// Assembles a file and has the checker prove it: what is written, every program can load. Throws
/// std::bad_alloc, and std::logic_error on a defect of the program.
CheckedImage assemble_checked(const AssetSource& source, std::span<const AssetLevel> levels);

}  // namespace tandem::build
