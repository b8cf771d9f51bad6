#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "opened_mesh.h"
#include "tandem/formats/view.h"

namespace tandem::build {

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
