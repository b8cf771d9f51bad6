#pragma once

#include <cstdint>

#include "mesh.h"

namespace tandem::makeassets {

// Numbers of cells along x and y. A sheet has two triangles a cell.
struct Cells {
  std::uint32_t x, y;
};

// The division of triangles / 2 (triangles even, positive) into x * y cells, y <= x, that is nearest to a
// square.
[[nodiscard]] Cells cells_for(std::uint64_t triangles);

// A gently uneven, square sheet of side `side`, centred at the origin, |z| <= 1 m, facing up. The ground is a
// function of the position and the seed alone: sheets of other triangle counts sample the same hills.
[[nodiscard]] Mesh terrain(Cells cells, double side, std::uint32_t seed);

}  // namespace tandem::makeassets
