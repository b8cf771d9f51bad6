#pragma once
#include <vector>

#include "bounds.h"
#include "tree.h"

namespace tandem::build {

/// The bounds of all triangles, moved and scaled so that the lower corner of the mesh lies at zero and its
/// longest edge between 1 and 2: surfaces of huge, tiny or far meshes neither overflow nor vanish.
/// Coordinates are finite floats; their differences and the scaled ones are taken in float64.
std::vector<Bounds> normalized_bounds(const Geometry& geometry);

}  // namespace tandem::build
