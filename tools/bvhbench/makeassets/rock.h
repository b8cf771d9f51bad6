#pragma once

#include <cstdint>

#include "mesh.h"

namespace tandem::makeassets {

// The number of rows of a rock's eight sides nearest below which 8 * rows^2 is this number of triangles.
[[nodiscard]] std::uint32_t rock_side_for(std::uint64_t triangles);

// A rock about 1 m long, closed, of 8 * side^2 triangles: an ellipsoid whose surface is moved along rays from
// its centre by noise of ever shorter wavelengths, down to that of a scanner, which differs from vertex to
// vertex. No ray from the centre meets the surface twice, so it does not intersect itself. The shape depends
// on the seed and, but for the scanner's noise, not on `side`.
[[nodiscard]] Mesh rock(std::uint32_t side, std::uint32_t seed);

}  // namespace tandem::makeassets
