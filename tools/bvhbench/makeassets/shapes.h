#pragma once
#include "mesh.h"

namespace tandem::makeassets {

// A cow, about 1 m long, which faces +x and stands on the plane z = 0, as a closed mesh of exactly
// `triangles` (even) triangles.
[[nodiscard]] Mesh cow_mesh(std::size_t triangles);

// The number of rows of a rock's eight sides nearest below which 8 * rows^2 is this number of triangles.
[[nodiscard]] std::uint32_t rock_side_for(std::uint64_t triangles);

// A rock about 1 m long, closed, of 8 * side^2 triangles: an ellipsoid whose surface is moved along rays from
// its centre by noise of ever shorter wavelengths, down to that of a scanner, which differs from vertex to
// vertex. No ray from the centre meets the surface twice, so it does not intersect itself. The shape depends
// on the seed and, but for the scanner's noise, not on `side`.
[[nodiscard]] Mesh rock(std::uint32_t side, std::uint32_t seed);

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
