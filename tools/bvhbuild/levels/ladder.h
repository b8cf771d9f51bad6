#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "bvhbuild/tree/surface_topology.h"
#include "bvhbuild/tree/tree.h"
#include "level_mesh.h"

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

struct Ladder {
  std::vector<LadderLevel> levels;    ///< errors ascend, triangles descend
  std::vector<std::size_t> left_out;  ///< which errors got no level of their own
  std::uint64_t fixed_vertices = 0;   ///< where surfaces meet: they stay in place at every level
};

/// Makes a level for each wanted error: the one with the fewest triangles, or nearly, that is proved to be
/// at most so far from the finest, of those that collapses of edges lead to. There is none where it would
/// have as many triangles as the one before. The result does not depend on the number of threads.
/// wanted: lengths in the unit of the coordinates, ascending. progress: is told the share that is done.
/// Condition: fewer than kMostTopologyTriangles.
Ladder make_ladder(const FinestLevel& finest, std::span<const double> wanted,
                   const std::function<void(double)>& progress);

}  // namespace tandem::build
