#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tandem/build/clean_report.h"
#include "tandem/build/mesh.h"

namespace tandem::build {

/// A vertex index that names no vertex, whatever their number: what a reader stores for an index that cannot
/// be represented (negative, 0 in an OBJ file, beyond 2^32 - 2).
inline constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;

/// Counts what a file holds instead of faces. Readers leave it out.
struct LeftOut {
  bool points = false, lines = false;
  bool strip_turns = false;  ///< triangles of a strip that name a vertex twice: they only lead it elsewhere
};

/// The mesh that a reader hands over: the polygons of a file, in the file's order, with the file's float64
/// coordinates. Nothing in it is checked but its shape: indices may be out of range, coordinates not finite,
/// polygons degenerate. Points and lines of formats that tell them from faces are left out. Whatever the file
/// calls a face counts, also one of fewer than three corners: face f is the f-th that the modeller wrote.
struct PolygonMesh {
  std::vector<Point> points;
  std::vector<std::uint32_t> corners;        ///< vertex indices of all faces, one face after the other
  std::vector<std::uint32_t> face_begin{0};  ///< face f has corners [face_begin[f], face_begin[f + 1])
  std::vector<SourcePart> parts;             ///< ascending, without gaps, together all faces
  /// These say where the points are in other samples of an animation. They are finite and at most
  /// kMaxCoordinate in magnitude.
  std::vector<std::vector<Point>> poses{};
  LeftOut left_out;
  std::string reader;             ///< who read the file, for the report: "tandem PLY", "assimp 5.2.5"
  bool single_precision = false;  ///< the reader keeps only float32 of each coordinate
  std::vector<std::string>
      remarks;  ///< oddities worth telling, at most a few: "line 12: face index 99 of 8 vertices"

  std::size_t face_count() const { return face_begin.size() - 1; }
};

/// Threads take so many triangles of a mesh at once.
inline constexpr std::size_t kTrianglesAtOnce = 1 << 14;

/// The triangles of a file with its float64 coordinates. Every index is below points.size(), every coordinate
/// that a triangle uses is finite and at most kMaxCoordinate in magnitude.
struct TriangleMesh {
  std::vector<Point> points;
  std::vector<TriangleIndices> triangles;
  std::vector<std::uint32_t> face;  ///< of each triangle: the face of the file that it is a piece of
  /// This names the vertex of the file of each point, ascending. Empty: point i is vertex i.
  std::vector<std::uint32_t> source_vertex{};
  /// These say where the points are in other samples of an animation. They are finite and at most
  /// kMaxCoordinate in magnitude.
  std::vector<std::vector<Point>> poses{};
};

/// Returns whether a face can be split into triangles: its indices are in range, it has three corners or
/// more, and their coordinates are finite and at most kMaxCoordinate in magnitude. Else it is counted, under
/// the first of these that fails.
bool is_usable(std::span<const Point> points, std::span<const std::uint32_t> corners, CleanReport& report);

/// Counts those of so many points that none of the corners names.
std::uint64_t count_unreferenced(std::size_t points, std::span<const std::uint32_t> corners);

/// Returns what triangulate() makes of a mesh whose faces are triangles: those that are usable, in their
/// order, the others counted. face: of each triangle; empty: triangle i is face i.
TriangleMesh take_triangles(std::span<const Point> points, std::span<const TriangleIndices> triangles,
                            std::span<const std::uint32_t> face, CleanReport& report);

/// Splits the faces of a file into triangles.
///
/// Effect: takes points, poses, corners and face_begin out of `mesh` (name, parts and remarks stay) and
/// counts in `report`.
///
/// Result: the triangles in the order of the faces. Faces with an index out of range, fewer than three
/// corners, a coordinate that is not finite or one beyond +-kMaxCoordinate are left out, each counted once,
/// under the first of these that holds.
///
/// Triangles stay as they are. In larger faces, a corner at the same place as the one before it is skipped
/// and the face counted once, and a spike (from a place to another and straight back) becomes a degenerate
/// triangle: it has no area, and the face is split as if it were not there. What remains of a face without
/// any area is degenerate too; clean() drops and counts all these. They do not make a face "not simple".
/// Where there are poses, only corners that lie at the same place in all of them count as such.
///
/// A quad is cut along the diagonal that lies inside, the shorter one if both do. A larger face is projected
/// along the main axis of its Newell normal (Newell in Sutherland, Sproull & Schumacker 1974) and
/// triangulated exactly, holes reached by bridges included. Only the face's own vertices appear, each where
/// the outline has it, and its orientation stays. An outline that crosses itself makes a fan. The same input
/// gives the same triangles.
TriangleMesh triangulate(PolygonMesh& mesh, CleanReport& report);

/// Splits a polygon of five corners or more in its projection along a coordinate axis.
///
/// Effect: on success appends triangles to `out`, as indices into the corners, oriented as the polygon goes.
/// Result: whether it could.
using SplitPolygon = std::function<bool(std::span<const Point> polygon, int projection_axis,
                                        std::vector<TriangleIndices>& out)>;

/// Does the same with another way to split polygons of five corners or more. Takes no package.
TriangleMesh triangulate(PolygonMesh& mesh, CleanReport& report, const SplitPolygon& split);

/// Returns the first face of more than four corners, which triangulate() needs `split` for.
std::optional<std::size_t> first_face_beyond_quads(const PolygonMesh& mesh);

/// Welds, drops and counts; moves and rounds nothing.
///
/// Effect on `mesh`: vertices at exactly the same place become one (the first; -0.0 becomes 0.0); triangles
/// whose corners lie exactly on one line in the float64 coordinates go; vertices that no triangle uses go.
/// Order is kept otherwise. source_vertex says which vertices these were. Where there are poses, only
/// vertices that lie at the same place in all of them become one, and only triangles that are flat in all of
/// them go.
///
/// Effect on `report`: counts those, and the triangles that repeat an earlier one, which stay.
///
/// The result does not depend on the number of threads. Needs about 40 bytes a triangle beside an unwelded
/// mesh.
void clean(TriangleMesh& mesh, CleanReport& report);

/// The geometry as the .bvh file keeps it: a vertex lies at origin + point, rounded once.
struct StoredMesh {
  Point origin{};                            ///< float64; zero when every coordinate is a float32 number
  std::vector<std::array<float, 3>> points;  ///< relative to origin, finite
  std::vector<TriangleIndices> triangles;
  std::vector<std::uint32_t> face;                         ///< source face of each triangle
  std::vector<std::uint32_t> source_vertex{};              ///< of each point, ascending
  std::vector<std::vector<std::array<float, 3>>> poses{};  ///< relative to origin, rounded as points are
  double largest_rounding_error = 0;  ///< of any coordinate: |origin + point - vertex|, in the file's unit
};

/// Rounds a mesh to float32, the one rounding that geometry suffers here.
///
/// Effect: takes everything out of `mesh`; counts in `report` the triangles that become flat by the rounding.
/// They stay: a flat triangle is the hull of its points.
///
/// The origin is zero when every coordinate is a
/// float32 number already, so that nothing is rounded. Otherwise it is, axis by axis, zero when the box lies
/// near zero (|centre| <= half extent of the longest axis: moving could win at most one bit), else the centre
/// of the box on a coarse grid.
///
/// mesh: cleaned (no unused vertices, which would take part in the box)
StoredMesh to_single_precision(TriangleMesh& mesh, CleanReport& report);

}  // namespace tandem::build
