#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace tandem::makeassets {

using Point = std::array<double, 3>;
using Triangle = std::array<std::uint32_t, 3>;

// An indexed triangle mesh. Lengths are metres, z is up, and a triangle is anticlockwise seen from outside.
struct Mesh {
  std::vector<Point> points;
  std::vector<Triangle> triangles;
};

// Splits each triangle into four at the midpoints of its edges; the surface stays the same. The points of
// `mesh` keep their indices; the midpoints follow in the order in which the triangles name them.
[[nodiscard]] Mesh midpoint_subdivision(const Mesh& mesh);

// Moves each coordinate to the nearest multiple of 1 / per_metre.
void snap_to_grid(Mesh& mesh, double per_metre);

// The unit cube centred at the origin, two triangles a side.
[[nodiscard]] Mesh unit_cube();

}  // namespace tandem::makeassets
