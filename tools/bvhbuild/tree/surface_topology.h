#pragma once
#include <cstdint>
#include <vector>

#include "tandem/formats/topology.h"
#include "tree.h"

namespace tandem::build {

/// How the triangles of a level hang together, as it lies in the file.
struct SurfaceTopology {
  std::vector<TriangleTopology> triangles;   ///< in leaf order
  std::vector<SurfaceComponent> components;  ///< by first triangle
  std::uint32_t vertex_count = 0;
  bool closed = false;  ///< all components are
};

/// Welds corners at the same position, counts the sides of edges, and orients: windings are made to
/// agree across edges of two sides, the larger part of what these join keeping its own; closed components
/// that are inside out are turned, unless they are cavities (a vertex of theirs lies within other closed
/// components). A component that touches others wherever it was looked for such a vertex is none. Nothing is
/// moved: what is turned is marked. The result does not depend on the number of threads. Condition: fewer
/// than kMostTopologyTriangles.
SurfaceTopology make_topology(const Geometry& geometry, const Tree& tree);

}  // namespace tandem::build
