#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tandem::makeassets {

using Point = std::array<double, 3>;
using Triangle = std::array<std::uint32_t, 3>;

inline Point operator+(const Point& a, const Point& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Point operator-(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point operator*(double s, const Point& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
inline double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Point& a) {
  return std::sqrt(dot(a, a));
}

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

// Empty when `mesh` is one closed, outward oriented 2-manifold of genus 0 with `triangles` triangles, none
// flat, and without self-intersection (decided exactly, on the coordinates as they are); else the first
// defect, in words.
[[nodiscard]] std::string closed_mesh_defect(const Mesh& mesh, std::size_t triangles);

// Writes `mesh` whole or not at all (aside, then renamed): binary PLY with float32 coordinates when the name
// ends in .ply, else OBJ with at most six decimals. `comment` is one line of text for the header. Returns an
// empty string, or the reason of the failure.
[[nodiscard]] std::string write_mesh(const Mesh& mesh, const std::string& comment,
                                     const std::filesystem::path& path);

}  // namespace tandem::makeassets
