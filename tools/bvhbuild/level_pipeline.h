#pragma once
#include <functional>
#include <string>
#include <vector>

#include "bvhbuild/meshing/meshing.h"
#include "bvhbuild/tree/assemble.h"
#include "pipeline.h"

namespace tandem::build {

/// A level with everything that a file may say of it.
struct BuiltLevel : LevelParts {
  LevelMesh mesh;     ///< of the finest nothing: its geometry is that of the stored mesh
  Geometry geometry;  ///< looks at `mesh` or at the stored mesh
  std::vector<std::uint32_t> face;
  double error_bound = 0;
  /// This names the vertex of each point; it is empty for coarser levels, whose points are none of the file.
  std::span<const std::uint32_t> source_vertex{};

  /// Returns what the file gets of the level.
  AssetLevel row(const Options& options) const;
};

/// Builds the tree of a level and what belongs to it; topology also where other levels need it. The geometry
/// must outlive the result.
BuiltLevel build_level(const Geometry& geometry, const Options& options, OptimisationWatch& watch);

/// Says what is wrong with the errors that were asked for, now that the mesh is known; empty where nothing
/// is.
std::string level_errors_defect(const Options& options, const StoredMesh& mesh);

/// Adds the levels that were asked for to the finest one, and says in `outcome` which there are not.
void add_levels(const Options& options, const StoredMesh& mesh, OptimisationWatch& watch,
                std::vector<BuiltLevel>& levels, Outcome& outcome);

/// Builds all levels of a mesh and the file's bytes, and has the checker prove both: what is written, every
/// program can load. source: parts and number of faces; provenance(): what the file says of its making, asked
/// once `outcome` tells of the levels and samples. sample_names: of the mesh and its poses; needed where it
/// has poses.
CheckedImage build_file(const Options& options, const StoredMesh& mesh, AssetSource source,
                        const std::function<std::string()>& provenance, OptimisationWatch& watch,
                        Outcome& outcome, const std::vector<std::string>& sample_names = {});

/// Says what the levels of the file are like.
void describe_levels(const AssetView& asset, Outcome& outcome);

}  // namespace tandem::build
