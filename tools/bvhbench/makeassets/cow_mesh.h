#pragma once

#include "mesh.h"

namespace tandem::makeassets {

// The cow of cow_shape.h as a closed mesh of exactly `triangles` (even) triangles.
[[nodiscard]] Mesh cow_mesh(std::size_t triangles);

}  // namespace tandem::makeassets
