#include "bvhbuild/meshing/meshing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <set>

#include "tandem/formats/box.h"

namespace tandem::build {
namespace {

/// A polygon of integer points in the plane: its areas can be computed exactly.
struct GridPoint {
  std::int64_t x = 0;
  std::int64_t y = 0;
  bool operator==(const GridPoint&) const = default;
};
using GridPolygon = std::vector<GridPoint>;

/// Twice the signed area of a triangle, exact.
std::int64_t twice_area(const GridPoint& a, const GridPoint& b, const GridPoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Twice the signed area of a polygon, exact.
std::int64_t twice_area(const GridPolygon& polygon) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const GridPoint& a = polygon[i];
    const GridPoint& b = polygon[(i + 1) % polygon.size()];
    sum += a.x * b.y - b.x * a.y;
  }
  return sum;
}

/// Adds a face over existing points.
void add_face(PolygonMesh& mesh, std::initializer_list<std::uint32_t> corners) {
  mesh.corners.insert(mesh.corners.end(), corners);
  mesh.face_begin.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
}

/// One face over its own points, in the plane z = 0.
PolygonMesh flat_face(const GridPolygon& polygon) {
  PolygonMesh mesh;
  for (const GridPoint& p : polygon) {
    mesh.corners.push_back(static_cast<std::uint32_t>(mesh.points.size()));
    mesh.points.push_back({static_cast<double>(p.x), static_cast<double>(p.y), 0});
  }
  mesh.face_begin.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
  return mesh;
}

/// Whether the triangles, as indices into `polygon`, tile it: all have its orientation and some area, their
/// areas add up exactly, and each edge of the outline belongs to one of them while every other edge belongs
/// to two, once in each direction.
bool tiles(const std::vector<TriangleIndices>& triangles, const GridPolygon& polygon) {
  const std::int64_t area = twice_area(polygon);
  std::int64_t sum = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const TriangleIndices& t : triangles) {
    const std::int64_t piece = twice_area(polygon[t[0]], polygon[t[1]], polygon[t[2]]);
    if (piece == 0 || (piece > 0) != (area > 0)) return false;
    sum += piece;
    for (int k = 0; k < 3; ++k) {
      if (++balance[{t[k], t[(k + 1) % 3]}] > 1) return false;
    }
  }
  for (std::uint32_t i = 0; i < polygon.size(); ++i) {
    const auto next = static_cast<std::uint32_t>((i + 1) % polygon.size());
    if (balance[{i, next}] != 1 || balance.contains({next, i})) return false;
    balance.erase({i, next});
  }
  for (const auto& [edge, count] : balance)
    if (!balance.contains({edge.second, edge.first})) return false;
  return sum == area;
}

struct Outcome {
  TriangleMesh mesh;
  CleanReport report;
};

Outcome run(PolygonMesh mesh) {
  Outcome outcome;
  outcome.mesh = triangulate(mesh, outcome.report);
  return outcome;
}

GridPolygon reversed(GridPolygon polygon) {
  std::reverse(polygon.begin(), polygon.end());
  return polygon;
}

GridPolygon rotated_by(GridPolygon polygon, std::size_t steps) {
  std::rotate(polygon.begin(), polygon.begin() + static_cast<std::ptrdiff_t>(steps), polygon.end());
  return polygon;
}

/// From every first corner, in both directions.
void expect_tiled_however_written(const GridPolygon& polygon) {
  for (std::size_t steps = 0; steps < polygon.size(); ++steps)
    for (const GridPolygon& p : {rotated_by(polygon, steps), reversed(rotated_by(polygon, steps))}) {
      const Outcome outcome = run(flat_face(p));
      EXPECT_EQ(outcome.mesh.triangles.size(), p.size() - 2) << "from corner " << steps;
      EXPECT_TRUE(tiles(outcome.mesh.triangles, p)) << "from corner " << steps;
      EXPECT_EQ(outcome.report.faces_not_simple, 0u);
    }
}

double twice_signed_area_xy(const TriangleMesh& mesh) {
  double sum = 0;
  for (const TriangleIndices& t : mesh.triangles) {
    const Point& a = mesh.points[t[0]];
    const Point& b = mesh.points[t[1]];
    const Point& c = mesh.points[t[2]];
    sum += (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  }
  return sum;
}

TEST(Triangulate, LeavesTrianglesAsTheyAreAndInOrder) {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  add_face(mesh, {2, 0, 1});
  add_face(mesh, {3, 3, 1});
  add_face(mesh, {0, 3, 2});
  const Outcome outcome = run(mesh);
  EXPECT_EQ(outcome.mesh.triangles, (std::vector<TriangleIndices>{{2, 0, 1}, {3, 3, 1}, {0, 3, 2}}));
  EXPECT_EQ(outcome.mesh.face, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(Triangulate, EmptyMeshGivesNothing) {
  const Outcome outcome = run({});
  EXPECT_TRUE(outcome.mesh.triangles.empty());
  EXPECT_EQ(outcome.report.faces, 0u);
}

TEST(Triangulate, TilesConcavePolygonsAndStraightRunsOfCorners) {
  expect_tiled_however_written({{0, 0}, {10, 4}, {0, 8}, {3, 4}});
  expect_tiled_however_written({{0, 0}, {5, 0}, {10, 0}, {4, 7}});
  expect_tiled_however_written({{0, 0}, {10, 0}, {10, 10}, {5, 3}, {0, 10}});
  expect_tiled_however_written({{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 4}, {0, 4}});
  expect_tiled_however_written(
      {{0, -10}, {2, -3}, {9, -3}, {4, 1}, {6, 8}, {0, 4}, {-6, 8}, {-4, 1}, {-9, -3}, {-2, -3}});
  expect_tiled_however_written({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {3, 2}, {3, 3}, {0, 3}, {0, 1}});
}

/// A face and what becomes of it. What is left out is not looked at, but for faces that are not simple.
struct FaceRow {
  const char* what;
  GridPolygon points;
  std::vector<std::uint32_t> corners = {};  ///< empty: all points in order
  std::optional<std::vector<TriangleIndices>> triangles = {};
  std::optional<std::size_t> count = {};  ///< of triangles
  std::optional<double> twice_area = {};
  std::optional<std::uint64_t> repeated_corners = {};
  std::uint64_t not_simple = 0;
  double (*height)(std::size_t corner, const Point& at) = nullptr;  ///< else 0
};

TEST(Triangulate, CutsEachFaceAsItShould) {
  const GridPolygon four = {{0, 0}, {4, 0}, {0, 4}, {9, 9}};
  const FaceRow rows[] = {
      {"a convex quad along its shorter diagonal",
       {{0, 0}, {10, 0}, {12, 5}, {2, 5}},
       {},
       {{{3, 0, 1}, {3, 1, 2}}}},
      {"a square from its first corner", {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {}, {{{0, 1, 2}, {0, 2, 3}}}},
      {.what = "a saddle quad without turning a piece over",
       .points = {{0, 0}, {1, 0}, {1, 1}, {0, 1}},
       .count = 2,
       .twice_area = 2,
       .height = [](std::size_t corner, const Point&) { return corner % 2 == 0 ? 0.0 : 2.0; }},
      {"a hole behind a bridge stays open",
       {{0, 0}, {9, 0}, {9, 9}, {0, 9}, {3, 3}, {3, 6}, {6, 6}, {6, 3}},
       {0, 1, 2, 3, 0, 4, 5, 6, 7, 4},
       {},
       8,
       2 * (81 - 9)},
      {"a hole behind a bridge with vertices of its own",
       {{0, 0}, {9, 0}, {9, 9}, {0, 9}, {0, 0}, {3, 3}, {3, 6}, {6, 6}, {6, 3}, {3, 3}},
       {},
       {},
       8,
       2 * (81 - 9)},
      {"lobes that meet in one vertex",
       {{0, 0}, {4, -1}, {4, 1}, {-1, 4}, {-1, 5}, {-4, -1}, {-4, -2}},
       {0, 1, 2, 0, 3, 4, 0, 5, 6},
       {},
       3},
      {"corners that repeat their predecessors: 4 lies on 2, 5 on 0",
       {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {4, 4}, {0, 0}},
       {0, 0, 1, 2, 4, 3, 5},
       {{{0, 1, 2}, {0, 2, 3}}},
       {},
       {},
       1},
      {"a face on one place is one degenerate triangle", {{1, 1}, {1, 1}, {1, 1}, {1, 1}}, {}, {{{0, 0, 0}}}},
      {.what = "a fan of a pentagram",
       .points = {{0, 10}, {6, -8}, {-10, 3}, {10, 3}, {-6, -8}},
       .count = 3,
       .not_simple = 1},
      // A roof with a hole behind a bridge from the middle of an edge; its heights are rounded, and differ
      // where they meet.
      {.what = "an outline that touches itself but for the last bits",
       .points = {{0, 0}, {3, 0}, {3, 3}, {3, 6}, {6, 6}, {6, 3}, {3, 3}, {3, 0}, {9, 0}, {9, 9}, {0, 9}},
       .twice_area = 2 * (81 - 9),
       .height =
           [](std::size_t corner, const Point& at) {
             const double height = 0.1 * at[0] + 0.7 * at[1];
             return corner == 6 ? std::nextafter(height, 10) : height;
           }},
      {.what = "a corner twice in a row", .points = four, .corners = {0, 1, 1, 2}, .repeated_corners = 1},
      {.what = "the first corner at the end", .points = four, .corners = {0, 1, 2, 0}, .repeated_corners = 1},
      {.what = "two corners twice", .points = four, .corners = {0, 0, 1, 2, 2}, .repeated_corners = 1},
      {.what = "a spike repeats none", .points = four, .corners = {0, 1, 3, 1, 2}, .repeated_corners = 0},
      {.what = "a corner again later", .points = four, .corners = {0, 1, 2, 0, 3}, .repeated_corners = 0},
      {.what = "a degenerate triangle", .points = four, .corners = {0, 1, 1}, .repeated_corners = 0}};
  for (const FaceRow& row : rows) {
    SCOPED_TRACE(row.what);
    PolygonMesh mesh = flat_face(row.points);
    for (std::size_t i = 0; i < mesh.points.size() && row.height != nullptr; ++i)
      mesh.points[i][2] = row.height(i, mesh.points[i]);
    if (!row.corners.empty()) mesh.corners = row.corners;
    mesh.face_begin.back() = static_cast<std::uint32_t>(mesh.corners.size());
    const Outcome outcome = run(mesh);
    if (row.triangles) {
      EXPECT_EQ(outcome.mesh.triangles, *row.triangles);
    }
    if (row.count) {
      EXPECT_EQ(outcome.mesh.triangles.size(), *row.count);
    }
    if (row.twice_area) {
      EXPECT_EQ(twice_signed_area_xy(outcome.mesh), *row.twice_area);
    }
    if (row.repeated_corners) {
      EXPECT_EQ(outcome.report.faces_repeated_corner, *row.repeated_corners);
    }
    EXPECT_EQ(outcome.report.faces_not_simple, row.not_simple);
  }
}

TEST(Triangulate, TilesSpiral) {
  const auto at = [](int step, double radius) {
    return GridPoint{std::llround(radius * std::cos(0.3 * step)),
                     std::llround(radius * std::sin(0.3 * step))};
  };
  GridPolygon spiral;
  for (int step = 0; step < 60; ++step) spiral.push_back(at(step, 1000 + 10 * step));
  for (int step = 59; step >= 0; --step) spiral.push_back(at(step, 1100 + 10 * step));
  expect_tiled_however_written(spiral);
}

TEST(Triangulate, LeavesTwoHolesOpenAndKeepsOrientation) {
  GridPolygon polygon{{0, 0}, {20, 0}, {20, 9}, {0, 9},  {0, 0},  {3, 3},  {3, 6}, {6, 6},
                      {6, 3}, {12, 3}, {12, 6}, {15, 6}, {15, 3}, {12, 3}, {6, 3}, {3, 3}};
  for (const GridPolygon& p : {polygon, reversed(polygon)}) {
    const Outcome outcome = run(flat_face(p));
    EXPECT_EQ(outcome.mesh.triangles.size(), p.size() - 2);
    EXPECT_EQ(twice_signed_area_xy(outcome.mesh), static_cast<double>(twice_area(p)));
    EXPECT_EQ(outcome.report.faces_not_simple, 0u);
  }
}

TEST(Triangulate, FansOutlinesThatCrossThemselvesAndCountsThem) {
  PolygonMesh mesh = flat_face({{0, 0}, {4, 0}, {0, 3}, {4, 3}, {2, 7}, {9, 1}});
  mesh.corners = {0, 1, 2, 3, 0, 3, 1, 4, 2, 5};
  mesh.face_begin = {0, 4, 10};
  const Outcome outcome = run(mesh);
  EXPECT_EQ(outcome.report.faces_not_simple, 2u);
  EXPECT_EQ(outcome.mesh.triangles.size(), 2u + 4u);
  EXPECT_EQ(outcome.mesh.triangles[0], (TriangleIndices{0, 1, 2}));
}

TEST(Triangulate, DoesNotCallFaceOnALineCrossed) {
  PolygonMesh mesh;
  for (int i = 0; i < 6; ++i)
    mesh.points.push_back({1.0 * (i * i % 5), 2.0 * (i * i % 5), -1.0 * (i * i % 5)});
  add_face(mesh, {0, 1, 2, 3, 4});
  add_face(mesh, {0, 1, 2, 5});
  EXPECT_EQ(run(mesh).report.faces_not_simple, 0u);
}

TEST(Triangulate, SplitsHelixWhoseEndsCoverEachOther) {
  // Seen along any axis, corners or edges coincide that are far apart in space; they must not be taken for
  // each other.
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0}, {4, 0, 1}, {4, 4, 2}, {0, 4, 3}, {0, 0, 4}};
  add_face(mesh, {0, 1, 2, 3, 4});
  const Outcome outcome = run(mesh);
  ASSERT_EQ(outcome.mesh.triangles.size(), 3u);
  std::vector<bool> used(5, false);
  for (const TriangleIndices& t : outcome.mesh.triangles)
    for (const std::uint32_t corner : t) used[corner] = true;
  EXPECT_EQ(std::count(used.begin(), used.end(), true), 5);
}

/// Both corners of each bridge end, one raised by less than what counts as apart, must stay in use: with its
/// own corner in each angle, the triangles tile the outline index by index.
TEST(Triangulate, UsesEachCornerInItsOwnAngleWhereCornersMeetInProjection) {
  const GridPolygon one_hole{{0, 0}, {9, 0}, {9, 9}, {0, 9}, {0, 0}, {3, 3}, {3, 6}, {6, 6}, {6, 3}, {3, 3}};
  const GridPolygon two_holes{{0, 0}, {20, 0}, {20, 9}, {0, 9},  {0, 0},  {3, 3},  {3, 6}, {6, 6},
                              {6, 3}, {12, 3}, {12, 6}, {15, 6}, {15, 3}, {12, 3}, {6, 3}, {3, 3}};
  for (const GridPolygon& whole : {one_hole, two_holes, reversed(one_hole), reversed(two_holes)})
    for (std::size_t steps = 0; steps < whole.size(); ++steps)
      for (const double height : {0.0, 1e-7, 5e-324}) {
        const GridPolygon polygon = rotated_by(whole, steps);
        PolygonMesh mesh = flat_face(polygon);
        for (std::size_t i = 0; i < mesh.points.size(); i += 2) mesh.points[i][2] = height;
        const Outcome outcome = run(mesh);
        EXPECT_EQ(outcome.report.faces_not_simple, 0u);
        EXPECT_TRUE(tiles(outcome.mesh.triangles, polygon))
            << "from corner " << steps << " height " << height;
      }
}

TEST(Triangulate, UsesEachCornerOfLobesThatMeetInProjection) {
  const GridPolygon lobes{{0, 0}, {4, -1}, {4, 1}, {0, 0}, {-1, 4}, {-1, 5}, {0, 0}, {-4, -1}, {-4, -2}};
  for (const GridPolygon& polygon : {lobes, reversed(lobes)}) {
    PolygonMesh mesh = flat_face(polygon);
    for (std::size_t i = 0; i < mesh.points.size(); ++i) mesh.points[i][2] = 1e-9 * static_cast<double>(i);
    const Outcome outcome = run(mesh);
    EXPECT_EQ(outcome.report.faces_not_simple, 0u);
    ASSERT_EQ(outcome.mesh.triangles.size(), 3u);
    for (TriangleIndices t : outcome.mesh.triangles) {  // each lobe is three consecutive corners
      std::sort(t.begin(), t.end());
      EXPECT_TRUE(t[2] - t[0] == 2 || (t[0] == 0 && t[1] + 1 == t[2] && t[2] == 8) ||
                  (t[0] == 0 && t[1] == 1 && t[2] == 8))
          << t[0] << " " << t[1] << " " << t[2];
    }
  }
}

TEST(Triangulate, TurnsSpikesIntoDegenerateTriangles) {
  // A square; 4 is a spike inside, 5 outside across an edge, 6 and 7 a spike with a branch.
  PolygonMesh mesh = flat_face({{0, 0}, {9, 0}, {9, 9}, {0, 9}, {4, 5}, {20, -3}, {6, 1}, {7, 2}, {7, 0}});
  mesh.corners = {0, 4, 0, 1, 6, 7, 6, 8, 6, 1, 2, 5, 2, 3};
  mesh.face_begin = {0, 14};
  for (std::size_t steps = 0; steps < 14; ++steps) {
    const Outcome outcome = run(mesh);
    EXPECT_EQ(outcome.report.faces_not_simple, 0u);
    std::size_t spikes = 0;
    for (const TriangleIndices& t : outcome.mesh.triangles) spikes += t[0] == t[2] && t[0] != t[1];
    EXPECT_EQ(spikes, 5u) << "from corner " << steps;
    EXPECT_EQ(outcome.mesh.triangles.size(), 7u);
    EXPECT_EQ(twice_signed_area_xy(outcome.mesh), 2 * 81);
    std::rotate(mesh.corners.begin(), mesh.corners.begin() + 1, mesh.corners.end());
  }
}

TEST(Triangulate, TurnsFaceOfSpikesIntoDegenerateTriangles) {
  PolygonMesh mesh = flat_face({{0, 0}, {9, 0}, {9, 9}, {0, 9}});
  add_face(mesh, {0, 1, 2, 1});
  add_face(mesh, {0, 1, 2, 3, 2, 1});
  add_face(mesh, {0, 1, 0, 2, 0, 3});
  mesh.corners.erase(mesh.corners.begin(), mesh.corners.begin() + 4);
  mesh.face_begin = {0, 4, 10, 16};
  const Outcome outcome = run(mesh);
  EXPECT_EQ(outcome.report.faces_not_simple, 0u);
  for (const TriangleIndices& t : outcome.mesh.triangles) EXPECT_EQ(t[0], t[2]);
  EXPECT_EQ(std::set<std::uint32_t>(outcome.mesh.face.begin(), outcome.mesh.face.end()).size(), 3u);
}

TEST(Triangulate, WorksInEveryPlaneAndAtEveryScale) {
  const GridPolygon star{{0, -10}, {2, -3}, {9, -3}, {4, 1},   {6, 8},
                         {0, 4},   {-6, 8}, {-4, 1}, {-9, -3}, {-2, -3}};
  for (int axis = 0; axis < 3; ++axis)
    for (const double scale : {1.0, 0x1p-1060, 0x1p-500, 0x1p100, 0x1p123}) {
      PolygonMesh mesh = flat_face(star);
      for (Point& p : mesh.points) {
        const Point q{p[0] * scale, p[1] * scale, 0};
        for (int k = 0; k < 3; ++k) p[(k + axis) % 3] = q[k];
      }
      const Outcome outcome = run(mesh);
      EXPECT_TRUE(tiles(outcome.mesh.triangles, star)) << axis << " " << scale;
    }
}

TEST(Triangulate, DropsEachBadFaceOnceUnderItsFirstReason) {
  PolygonMesh mesh;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  mesh.points = {{0, 0, 0},
                 {1, 0, 0},
                 {0, 1, 0},
                 {nan, 0, 0},
                 {0, -infinity, 0},
                 {0, 0, 1e39},
                 {0, 0, double{kMaxCoordinate}},
                 {9, 9, 9}};
  add_face(mesh, {0, 1, 2});
  add_face(mesh, {0, 3, kNoVertex, 5});  // all three: counted as an index
  add_face(mesh, {0, 8, 1});
  add_face(mesh, {3, 5, 4});  // counted as not finite
  add_face(mesh, {0, 1, 2, 4});
  add_face(mesh, {0, 1, 5});
  add_face(mesh, {0, 1, 6});
  const Outcome outcome = run(mesh);
  EXPECT_EQ(outcome.report.faces, 7u);
  EXPECT_EQ(outcome.report.faces_index_out_of_range, 2u);
  EXPECT_EQ(outcome.report.faces_not_finite, 2u);
  EXPECT_EQ(outcome.report.faces_too_large, 1u);
  EXPECT_EQ(outcome.mesh.face, (std::vector<std::uint32_t>{0, 6}));
  EXPECT_EQ(outcome.report.vertices, 8u);
  EXPECT_EQ(outcome.report.vertices_unreferenced, 1u);
}

TEST(Triangulate, DropsFacesOfFewerThanThreeCornersAndKeepsCount) {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {std::numeric_limits<double>::infinity(), 0, 0}};
  add_face(mesh, {});
  add_face(mesh, {0});
  add_face(mesh, {0, 1, 2});
  add_face(mesh, {0, 3});  // not finite as well: counted once
  add_face(mesh, {0, 4});  // counted as an index
  add_face(mesh, {2, 1, 0});
  const Outcome outcome = run(mesh);
  EXPECT_EQ(outcome.report.faces, 6u);
  EXPECT_EQ(outcome.report.faces_too_few_corners, 3u);
  EXPECT_EQ(outcome.report.faces_index_out_of_range, 1u);
  EXPECT_EQ(outcome.report.faces_not_finite, 0u);
  EXPECT_EQ(outcome.mesh.face, (std::vector<std::uint32_t>{2, 5}));
}

TEST(Triangulate, NumbersTrianglesByTheFaceTheyCameFrom) {
  PolygonMesh mesh = flat_face({{0, 0}, {4, 0}, {4, 4}, {2, 6}, {0, 4}});
  add_face(mesh, {0, 1, 2});
  add_face(mesh, {0, 1, 2, 4});
  EXPECT_EQ(run(mesh).mesh.face, (std::vector<std::uint32_t>{0, 0, 0, 1, 2, 2}));
}

PolygonMesh one_face(std::vector<Point> points) {
  PolygonMesh mesh;
  mesh.points = std::move(points);
  for (std::uint32_t i = 0; i < mesh.points.size(); ++i) mesh.corners.push_back(i);
  mesh.face_begin.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
  return mesh;
}

Point on_circle(double radius, double turn) {
  const double angle = 2 * std::numbers::pi * turn;
  return {radius * std::cos(angle), radius * std::sin(angle), 0.25 * radius * std::cos(angle)};
}

TEST(Triangulate, SplitsFacesOfManyCorners) {
  constexpr int kCorners = 20000;
  std::vector<Point> circle;
  std::vector<Point> star;
  std::vector<Point> comb{{-1, -1, 0}};
  for (int i = 0; i < kCorners; ++i) {
    circle.push_back(on_circle(1, i / double{kCorners}));
    star.push_back(on_circle(i % 2 ? 0.01 : 1, i / double{kCorners}));
    comb.push_back({i + 0.5 * (i % 2), i % 2 ? 1e5 : 0.0, 0});
  }
  comb.push_back({kCorners, -1, 0});
  std::reverse(comb.begin(), comb.end());
  for (const auto& points : {circle, star, comb}) {
    const Outcome outcome = run(one_face(points));
    EXPECT_EQ(outcome.mesh.triangles.size(), points.size() - 2);
    EXPECT_EQ(outcome.report.faces_not_simple, 0u);
    EXPECT_GT(twice_signed_area_xy(outcome.mesh), 0);
  }
}

/// Each of these took quadratic time, minutes at this size.
TEST(Triangulate, TakesLinesOfManyCorners) {
  constexpr std::uint32_t kCorners = 100000;
  std::vector<Point> diagonal;
  std::vector<Point> shuffled;  // on the x axis, to and fro
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    diagonal.push_back({1.0 * i, 1.0 * i, 0});
    shuffled.push_back({1.0 * (i * 2919u % kCorners), 0, 0});
  }
  for (const auto& points : {diagonal, shuffled}) {
    const Outcome outcome = run(one_face(points));
    EXPECT_EQ(outcome.mesh.triangles.size(), kCorners - 2);
    EXPECT_EQ(outcome.report.faces_not_simple, 0u);
  }
  for (std::uint32_t i = 0; i < kCorners; ++i) diagonal[i] = {1.0 * i, 0, 0};
  diagonal.push_back({5, 1, 0});  // a triangle, one side of which has all the other corners
  const Outcome triangle = run(one_face(diagonal));
  EXPECT_EQ(triangle.mesh.triangles.size(), kCorners - 1);
  EXPECT_EQ(twice_signed_area_xy(triangle.mesh), kCorners - 1);
  EXPECT_EQ(triangle.report.faces_not_simple, 0u);
  shuffled.push_back({5, 1, 0});
  EXPECT_EQ(run(one_face(shuffled)).report.faces_not_simple, 1u);
}

TEST(Triangulate, TakesHubsOfManyEdges) {
  constexpr std::uint32_t kRim = 50000;
  std::vector<Point> wheel;
  for (std::uint32_t i = 0; i < kRim; ++i) {
    const double x = 1 + i % 200;
    const double y = 1 + i / 200;
    wheel.push_back({x, y, 0});
  }
  wheel.push_back({0, 0, 0});
  PolygonMesh spiked = one_face(wheel);   // hub, rim, hub, rim, ...
  PolygonMesh crossed = one_face(wheel);  // through the hub from one side to the other, again and again
  spiked.corners.clear();
  crossed.corners.clear();
  for (std::uint32_t i = 0; i < kRim; ++i) {
    spiked.corners.insert(spiked.corners.end(), {kRim, i});
    const auto opposite = static_cast<std::uint32_t>(crossed.points.size());
    crossed.points.push_back({-wheel[i][0], -wheel[i][1], 0});
    crossed.corners.insert(crossed.corners.end(), {i, opposite});
  }
  crossed.corners.push_back(kRim);
  spiked.face_begin.back() = static_cast<std::uint32_t>(spiked.corners.size());
  crossed.face_begin.back() = static_cast<std::uint32_t>(crossed.corners.size());
  const Outcome spikes = run(std::move(spiked));
  EXPECT_EQ(spikes.report.faces_not_simple, 0u);
  EXPECT_EQ(twice_signed_area_xy(spikes.mesh), 0);
  EXPECT_EQ(run(std::move(crossed)).report.faces_not_simple, 1u);
}

TEST(Triangulate, GivesTheSameTrianglesEachTime) {
  std::vector<Point> gear;
  for (int i = 0; i < 3000; ++i) gear.push_back(on_circle(i % 4 < 2 ? 1 : 0.9, i / 3000.0));
  const std::vector<TriangleIndices> first = run(one_face(gear)).mesh.triangles;
  PolygonMesh twice = one_face(gear);  // after other faces, in memory that was used before
  add_face(twice, {0, 1, 2, 3, 4, 5, 6});
  twice.corners.insert(twice.corners.end(), twice.corners.begin(), twice.corners.begin() + 3000);
  twice.face_begin.push_back(static_cast<std::uint32_t>(twice.corners.size()));
  const std::vector<TriangleIndices> both = run(twice).mesh.triangles;
  ASSERT_EQ(first.size(), 2998u);
  EXPECT_TRUE(std::equal(first.begin(), first.end(), both.begin()));
  EXPECT_TRUE(std::equal(first.rbegin(), first.rend(), both.rbegin()));
}

int sign(std::int64_t x) {
  return (x > 0) - (x < 0);
}

bool within(const GridPoint& a, const GridPoint& b, const GridPoint& p) {
  return std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) && std::min(a.y, b.y) <= p.y &&
         p.y <= std::max(a.y, b.y);
}

/// Whether the closed segments ab and cd meet.
bool meet(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d) {
  const int abc = sign(twice_area(a, b, c));
  const int abd = sign(twice_area(a, b, d));
  const int cda = sign(twice_area(c, d, a));
  const int cdb = sign(twice_area(c, d, b));
  if (abc * abd < 0 && cda * cdb < 0) return true;
  return (abc == 0 && within(a, b, c)) || (abd == 0 && within(a, b, d)) || (cda == 0 && within(c, d, a)) ||
         (cdb == 0 && within(c, d, b));
}

/// The first two edges that cross or touch where they should not; {0, 0} in a simple polygon.
std::array<std::size_t, 2> first_crossing(const GridPolygon& p) {
  const std::size_t n = p.size();
  for (std::size_t i = 0; i < n; ++i) {
    const GridPoint& a = p[i];
    const GridPoint& b = p[(i + 1) % n];
    if (twice_area(a, b, p[(i + 2) % n]) == 0 && !within(a, p[(i + 2) % n], b)) return {i, (i + 1) % n};
    for (std::size_t j = i + 2; j < n; ++j)
      if ((j + 1) % n != i && meet(a, b, p[j], p[(j + 1) % n])) return {i, j};
  }
  return {0, 0};
}

/// Random points joined at random, then untangled by reversing the stretch between two crossing edges. Empty
/// when that does not end soon.
GridPolygon random_polygon(std::mt19937& random, std::size_t corners, int grid) {
  std::uniform_int_distribution<int> coordinate(0, grid);
  GridPolygon polygon;
  while (polygon.size() < corners) {
    const GridPoint p{coordinate(random), coordinate(random)};
    if (std::find(polygon.begin(), polygon.end(), p) == polygon.end()) polygon.push_back(p);
  }
  for (int attempt = 0; attempt < 300; ++attempt) {
    auto [i, j] = first_crossing(polygon);
    if (i == j) return polygon;
    if (i > j) std::swap(i, j);
    std::reverse(polygon.begin() + static_cast<std::ptrdiff_t>(i + 1),
                 polygon.begin() + static_cast<std::ptrdiff_t>(j + 1));
    if (j == i + 1) std::swap(polygon[i], polygon[(j + 1) % corners]);
  }
  return {};
}

/// The polygon in a steep plane through integer points: still exact, and x, y and z take turns as the main
/// axis.
PolygonMesh tilted_face(const GridPolygon& polygon, std::int64_t a, std::int64_t b) {
  PolygonMesh mesh = flat_face(polygon);
  for (std::size_t i = 0; i < polygon.size(); ++i)
    mesh.points[i][2] = static_cast<double>(a * polygon[i].x + b * polygon[i].y);
  return mesh;
}

int expect_random_polygons_tiled(std::uint32_t seed, int count, std::size_t most_corners, int grid) {
  std::mt19937 random(seed);
  int tested = 0;
  for (int i = 0; i < count; ++i) {
    const std::size_t corners = 4 + random() % (most_corners - 3);
    const GridPolygon polygon = random_polygon(random, corners, grid);
    if (polygon.empty() || twice_area(polygon) == 0) continue;
    const auto a = static_cast<std::int64_t>(random() % 7) - 3;
    const auto b = static_cast<std::int64_t>(random() % 7) - 3;
    PolygonMesh mesh = tilted_face(polygon, a, b);
    CleanReport report;
    const TriangleMesh result = triangulate(mesh, report);
    EXPECT_EQ(result.triangles.size(), corners - 2) << "seed " << seed << " polygon " << i;
    EXPECT_TRUE(tiles(result.triangles, polygon)) << "seed " << seed << " polygon " << i;
    EXPECT_EQ(report.faces_not_simple, 0u);
    ++tested;
    if (::testing::Test::HasFailure()) break;
  }
  return tested;
}

TEST(TriangulateRandom, TilesSimplePolygons) {
  EXPECT_GT(expect_random_polygons_tiled(1, 3000, 40, 1000), 2000);
}

TEST(TriangulateRandom, TilesSimplePolygonsWithManyAlignedCorners) {
  EXPECT_GT(expect_random_polygons_tiled(2, 6000, 14, 6), 2000);
}

TEST(TriangulateRandom, TilesSimpleQuads) {
  EXPECT_GT(expect_random_polygons_tiled(3, 5000, 4, 4), 2000);
}

}  // namespace
}  // namespace tandem::build
