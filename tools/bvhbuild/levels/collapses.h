#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bvhbuild/meshing/meshing.h"
#include "bvhbuild/tree/surface_topology.h"
#include "bvhbuild/tree/tree.h"
#include "tandem/formats/view.h"

namespace tandem::build {

/// A coarser mesh, in the stored coordinates of the asset.
struct LevelMesh {
  std::vector<std::array<float, 3>> points;
  std::vector<TriangleIndices> triangles;
  std::vector<std::uint32_t> was;  ///< of each triangle: the one of level 0, in leaf order, that became it
};

/// A mesh whose edges have one side or two that run in opposite directions, and whose triangles around each
/// vertex follow each other over such edges: what simplifiers ask for. It is the surface of a level, cut open
/// where more than two triangles meet at an edge, where windings disagree, where surfaces touch in a vertex,
/// and where one vertex has more than 64 triangles, for which simplifying would take cubic time. Vertices
/// along the cuts are fixed, so that what was joined stays joined.
struct OpenedMesh {
  std::vector<std::array<float, 3>> points;
  std::vector<bool> fixed;                              ///< of each point
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< wound as level 0's topology says
  std::vector<std::uint32_t> was;                       ///< of each triangle, in leaf order of level 0
  /// The number of times that each triangle is there, those the other way round counted as less than none;
  /// empty: each once.
  std::vector<std::int32_t> copies;
  std::uint64_t fixed_vertices = 0;  ///< positions that points along the cuts have
};

/// Cuts a level open. Triangles with two corners at one position are left out, and of triangles with the same
/// corners there is one, with a number of copies where the level is closed, which it is by these. Condition:
/// fewer than kMostTopologyTriangles.
OpenedMesh cut_open(const Geometry& geometry, const Tree& tree, const SurfaceTopology& topology);

/// An edge shrinks to a point, and the triangles beside it vanish.
struct Collapse {
  std::uint32_t gone, kept;    ///< points at its ends; both go on as `kept`
  std::array<float, 3> point;  ///< where that now is
  std::uint32_t triangles;     ///< that are left
};

/// Collapses the edges of a mesh one after the other, the least harmful first, until none is left that can
/// be: a closed surface stays one, with four triangles at least, an open one keeps its boundary, fixed points
/// stay where they are, and no triangle turns by a right angle. Points stay within the bounds of the mesh. A
/// collapse that takes the surface farther than `distance` from the finest level, or that from it, is
/// refused; this is looked at in many points, but in these alone. The result depends on the arguments alone.
std::vector<Collapse> collapse_edges(const OpenedMesh& mesh, const LevelView& finest, double distance);

/// The mesh as it is after some collapses: the first ones of collapse_edges().
LevelMesh after(const OpenedMesh& mesh, std::span<const Collapse> collapses);

}  // namespace tandem::build
