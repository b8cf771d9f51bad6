#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>

#include "bvhbuild/meshing/meshing.h"
#include "parallel/parallel.h"
#include "tandem/build/clean_report.h"

namespace tandem::build {
namespace {

TriangleMesh mesh_of(std::vector<Point> points, std::vector<TriangleIndices> triangles) {
  TriangleMesh mesh{std::move(points), std::move(triangles), {}};
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) mesh.face.push_back(i);
  return mesh;
}

CleanReport cleaned(TriangleMesh& mesh) {
  CleanReport report;
  clean(mesh, report);
  return report;
}

TEST(Clean, WeldsVerticesAtExactlyTheSamePlaceAndNoOthers) {
  const double next = std::nextafter(1.0, 2.0);
  TriangleMesh mesh =
      mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 1, 0}, {next, 1, 0}, {1, 0, 5e-324}},
              {{0, 1, 2}, {3, 5, 4}, {6, 5, 0}});
  const CleanReport report = cleaned(mesh);
  EXPECT_EQ(report.vertices_welded, 2u);
  EXPECT_EQ(mesh.points, (std::vector<Point>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {next, 1, 0}, {1, 0, 5e-324}}));
  EXPECT_EQ(mesh.triangles, (std::vector<TriangleIndices>{{0, 1, 2}, {1, 3, 2}, {4, 3, 0}}));
}

TEST(Clean, WeldsNegativeZeroToZero) {
  TriangleMesh mesh = mesh_of({{-0.0, 0, 0}, {1, -0.0, 0}, {0, 1, 0}, {0, -0.0, 0}, {1, 0, 0}, {0, 0, 1}},
                              {{0, 1, 2}, {3, 4, 5}});
  const CleanReport report = cleaned(mesh);
  EXPECT_EQ(report.vertices_welded, 2u);
  ASSERT_EQ(mesh.points.size(), 4u);
  for (const Point& p : mesh.points)
    for (const double x : p) EXPECT_FALSE(std::signbit(x));
}

TEST(Clean, DropsExactlyDegenerateTrianglesOnly) {
  // The triangles of the shared file w_degenerate.obj.
  TriangleMesh mesh =
      mesh_of({{0, 0, 0},
               {1, 0, 0},
               {2, 0, 0},
               {0, 1, 0},
               {1, 1e-30, 0},
               {5, 5, 5},
               {5, 5, 5},
               {1e-42, 0, 0},
               {1, 1, 1}},
              {{0, 1, 2}, {0, 0, 1}, {5, 6, 5}, {5, 5, 5}, {0, 1, 4}, {0, 7, 3}, {0, 1, 3}, {1, 8, 3}});
  const CleanReport report = cleaned(mesh);
  EXPECT_EQ(report.triangles_degenerate, 4u);
  EXPECT_EQ(mesh.face, (std::vector<std::uint32_t>{4, 5, 6, 7}));
  EXPECT_EQ(mesh.points.size(), 6u);
  for (const TriangleIndices& t : mesh.triangles)
    for (const std::uint32_t corner : t) EXPECT_LT(corner, mesh.points.size());
}

TEST(Clean, DropsTriangleThatDegeneratesByWelding) {
  TriangleMesh mesh = mesh_of({{1, 2, 3}, {4, 5, 6}, {1, 2, 3}}, {{0, 1, 2}});
  EXPECT_EQ(cleaned(mesh).triangles_degenerate, 1u);
  EXPECT_TRUE(mesh.triangles.empty());
  EXPECT_TRUE(mesh.points.empty());
}

TEST(Clean, CountsDuplicatesOfBothOrientationsAndKeepsThem) {
  TriangleMesh mesh = mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}},
                              {{0, 1, 2}, {1, 2, 0}, {2, 1, 0}, {0, 2, 4}, {0, 1, 3}, {2, 0, 1}});
  const CleanReport report = cleaned(mesh);
  EXPECT_EQ(report.triangles_duplicate, 4u);
  EXPECT_EQ(report.triangles_duplicate_reversed, 2u);
  EXPECT_EQ(mesh.triangles.size(), 6u);
}

/// The hash multiplied words once, and this x made its first factor 0: all y with one z had one hash, and 200
/// thousand vertices took minutes.
TEST(Clean, WeldsInLinearTimeWhateverTheCoordinates) {
  const double x = std::bit_cast<double>(std::uint64_t{0xa0761d6478bd642f});
  const double y = std::bit_cast<double>(std::uint64_t{0xe7037ed1a0b428db});
  for (const bool fixed_x : {true, false}) {
    std::vector<Point> strip;
    std::vector<TriangleIndices> triangles;
    for (std::uint32_t i = 0; i < 100000; ++i)
      for (const double z : {0.0, 1.0})
        strip.push_back(fixed_x ? Point{x, 1.0 * i, z} : Point{1.0 * i, y, z});
    for (std::uint32_t i = 2; i < strip.size(); ++i) triangles.push_back({i - 2, i - 1, i});
    TriangleMesh mesh = mesh_of(std::move(strip), std::move(triangles));
    EXPECT_EQ(cleaned(mesh).vertices_welded, 0u);
    EXPECT_EQ(mesh.triangles.size(), 199998u);
  }
}

TEST(Clean, TakesAnEmptyMesh) {
  TriangleMesh mesh;
  const CleanReport report = cleaned(mesh);
  EXPECT_EQ(report.triangles_degenerate + report.vertices_welded + report.triangles_duplicate, 0u);
}

TriangleMesh random_soup(std::uint32_t seed, std::uint32_t triangles) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> coordinate(-4, 4);
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    for (int k = 0; k < 3; ++k)
      mesh.points.push_back(
          {coordinate(random) * 0.25, coordinate(random) * 0.25, coordinate(random) * -0.0});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    mesh.face.push_back(i);
  }
  return mesh;
}

/// Everything again the slow way, with ordered containers and integers.
TEST(Clean, AgreesWithASlowCountOnRandomSoup) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    TriangleMesh mesh = random_soup(seed, 500);
    std::set<Point> places;
    std::map<std::set<Point>, int> seen;
    std::uint64_t degenerate = 0;
    std::uint64_t duplicate = 0;
    for (const TriangleIndices& t : mesh.triangles) {
      const Point &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
      places.insert({a, b, c});
      if ((b[0] - a[0]) * (c[1] - a[1]) == (b[1] - a[1]) * (c[0] - a[0]))
        ++degenerate;
      else
        duplicate += seen[{a, b, c}]++ > 0;
    }
    const CleanReport report = cleaned(mesh);
    EXPECT_EQ(report.vertices_welded, 1500 - places.size());
    EXPECT_EQ(report.triangles_degenerate, degenerate);
    EXPECT_EQ(report.triangles_duplicate, duplicate);
    EXPECT_EQ(mesh.triangles.size(), 500 - degenerate);
  }
}

TEST(Clean, DoesNotDependOnTheNumberOfThreads) {
  TriangleMesh one = random_soup(99, 50000);
  TriangleMesh many = one;
  {
    const parallel::ThreadLimit single(1);
    cleaned(one);
  }
  const parallel::ThreadLimit several(8);
  cleaned(many);
  EXPECT_EQ(one.points, many.points);
  EXPECT_EQ(one.triangles, many.triangles);
  EXPECT_EQ(one.face, many.face);
}

TEST(Findings, ListEveryCountUnderItsOwnKey) {
  CleanReport report;
  report.faces_index_out_of_range = 1;
  report.faces_not_finite = 2;
  report.faces_too_large = 3;
  report.faces_not_simple = 4;
  report.vertices_unreferenced = 5;
  report.vertices_welded = 6;
  report.triangles_degenerate = 7;
  report.triangles_duplicate = 8;
  report.triangles_duplicate_reversed = 9;
  report.triangles_flattened = 10;
  report.faces_too_few_corners = 11;
  report.faces_repeated_corner = 12;
  std::set<std::string> keys;
  std::set<std::uint64_t> counts;
  for (const Finding& finding : findings(report)) {
    keys.insert(finding.key);
    counts.insert(finding.count);
    EXPECT_EQ(finding.sentence().find(std::to_string(finding.count) + " "), 0u);
  }
  EXPECT_EQ(keys.size(), 12u);
  EXPECT_EQ(counts.size(), 12u);
}

TEST(Findings, SpeakOfOneAndOfMany) {
  CleanReport report;
  report.faces_not_finite = 1;
  report.triangles_degenerate = 2;
  std::set<std::string> sentences;
  for (const Finding& finding : findings(report)) sentences.insert(finding.sentence());
  EXPECT_TRUE(sentences.contains("1 face has a coordinate that is NaN or infinite; dropped"));
  EXPECT_TRUE(sentences.contains("2 triangles have all corners on one line; dropped"));
}

TEST(Findings, CallWeldingNoDefect) {
  for (const Finding& finding : findings({}))
    EXPECT_EQ(finding.defect, std::string(finding.key) != "vertices_welded") << finding.key;
}

}  // namespace
}  // namespace tandem::build
