#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "bvhbuild/tree/surface_topology.h"
#include "bvhbuild/tree/tree.h"
#include "level_mesh.h"
#include "tandem/build/effort.h"

namespace tandem::build {

/// A level beyond the finest, without the tree that it will get.
struct LadderLevel {
  LevelMesh mesh;
  std::vector<std::uint32_t> nearest;  ///< of each triangle's middle: the triangle of the finest geometry
  std::size_t wanted = 0;              ///< which of the errors that were asked for
  double error_bound = 0;              ///< what is proved, at most that error
};

/// The finest level: what is simplified, and what the errors are measured against.
struct FinestLevel {
  Geometry geometry;
  const Tree& tree;
  const SurfaceTopology& topology;
};

/// Why there is no level for an error.
enum class NoLevel : std::uint8_t {
  no_coarser,   ///< it would have as many triangles as the one before, or more
  spared,       ///< a later level is coarser and nearer to the finest
  interrupted,  ///< its making was stopped
};

struct LeftOutError {
  std::size_t wanted;  ///< which of the errors that were asked for
  NoLevel why;
};

struct Ladder {
  std::vector<LadderLevel> levels;     ///< errors ascend, triangles descend
  std::vector<LeftOutError> left_out;  ///< in the order in which they were asked for
  std::uint64_t fixed_vertices = 0;    ///< where surfaces meet: they stay in place at every level
};

/// Makes a level for each wanted error: the one with the fewest triangles, or nearly, that is proved to be
/// at most so far from the finest, of those that collapses of edges lead to. Errors without a level are in
/// `left_out`. The result does not depend on the number of threads. wanted: lengths in the unit of the
/// coordinates, ascending. watch: its progress is told the share that is done; once its stop is set, no
/// further mesh is made, and what was found and proved until then stays. Condition: fewer than
/// kMostTopologyTriangles.
Ladder make_ladder(const FinestLevel& finest, std::span<const double> wanted, const OptimisationWatch& watch);

}  // namespace tandem::build
