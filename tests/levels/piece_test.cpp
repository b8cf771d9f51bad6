#include "levels/piece.h"

#include <gtest/gtest.h>

#include <random>

#include "levels/stored_level.h"

namespace tandem::levels {
namespace {

using Random = std::mt19937_64;

double uniform(Random& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

Point random_point(Random& random) {
  return {{uniform(random), uniform(random), uniform(random)}};
}

Point area(const Piece& piece) {
  return cross(minus(piece.corner[1].point, piece.corner[0].point),
               minus(piece.corner[2].point, piece.corner[0].point));
}

/// Whether a point of the piece's plane is within it, up to rounding.
bool contains(const Piece& piece, const Point& p) {
  const Point normal = area(piece);
  for (int k = 0; k < 3; ++k) {
    const Point &from = piece.corner[k].point, &to = piece.corner[(k + 1) % 3].point;
    if (dot(cross(minus(to, from), minus(p, from)), normal) < -1e-13) return false;
  }
  return true;
}

/// Each point of a piece is a point of a part, and no part is more than the piece: areas add up.
TEST(CutPiece, CoversThePieceWithItsParts) {
  Random random(1);
  constexpr int kEdges[][2] = {{0, 0}, {1, 0}, {2, 0}, {0, 1}, {1, 2}, {0, 2}};
  for (int trial = 0; trial < 600; ++trial) {
    Piece piece = {{}, INFINITY, 0, 0, 0, false};
    for (Corner& corner : piece.corner) corner = {random_point(random), 0, 0};
    Cut cut = {trial % 6 < 3 ? 1 : 2, {kEdges[trial % 6][0], kEdges[trial % 6][1]}, {}};
    Corner points[2] = {};
    for (int i = 0; i < cut.edges; ++i) {
      cut.along[i] = uniform(random);
      points[i].point = point_of(piece, cut, i);
    }
    Piece parts[kMostParts];
    const int count = cut_piece(piece, cut, points, parts);
    ASSERT_EQ(count, cut.edges + 1);
    Point sum = {};
    for (int i = 0; i < count; ++i) {
      EXPECT_EQ(parts[i].depth, 1);
      EXPECT_GE(dot(area(parts[i]), area(piece)), 0);
      sum = plus(sum, area(parts[i]));
    }
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(sum.x[k], area(piece).x[k], 1e-14);
    for (int sample = 0; sample < 100; ++sample) {
      const Point p =
          between(piece.corner[0].point,
                  between(piece.corner[1].point, piece.corner[2].point, uniform(random)), uniform(random));
      bool covered = false;
      for (int i = 0; i < count; ++i) covered = covered || contains(parts[i], p);
      EXPECT_TRUE(covered) << "trial " << trial;
    }
  }
}

/// A needle becomes its longest edge, whichever that is, and the distance of its third corner counts.
TEST(Flatten, MakesASegmentOfANeedle) {
  const Point ends[] = {{{0, 0, 0}}, {{0, 8, 0}}, {{0.25, 4, 0}}};
  for (int first = 0; first < 3; ++first) {
    Piece piece = {{}, INFINITY, 0, 0, 0, false};
    for (int k = 0; k < 3; ++k) piece.corner[k].point = ends[(first + k) % 3];
    flatten(piece, 0.2);
    EXPECT_FALSE(piece.is_segment);
    EXPECT_EQ(piece.excess, 0);
    flatten(piece, 0.25);
    ASSERT_TRUE(piece.is_segment);
    EXPECT_EQ(piece.excess, 0.25);
    EXPECT_EQ(piece.corner[0].point.x[1] + piece.corner[1].point.x[1], 8);
    EXPECT_EQ(piece.corner[1].point.x[1], piece.corner[2].point.x[1]);
  }
}

/// The parts of a segment are two segments that meet, and what was added to its bound is added to theirs.
TEST(CutPiece, HalvesASegment) {
  test::Mesh mesh;
  mesh.add({0, 0, 0}, {0, 2, 0}, {1, 0, 0});
  const test::StoredLevel level(mesh);
  Piece piece = {{}, INFINITY, 0.5, 0, 0, true};
  piece.corner[0] = {{{0, 0, 3}}, 3, 0};
  piece.corner[1] = piece.corner[2] = {{{0, 8, 3}}, std::sqrt(45.0), 0};
  const Cut cut = choose_cut(piece, level.view().triangles[0], 1e-9);
  ASSERT_EQ(cut.edges, 1);
  ASSERT_EQ(cut.edge[0], 0);
  Corner points[2] = {{point_of(piece, cut, 0), 0, 0}, {}};
  Piece parts[kMostParts];
  ASSERT_EQ(cut_piece(piece, cut, points, parts), 2);
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(parts[i].is_segment);
    EXPECT_EQ(parts[i].corner[1 - i].point.x[1], points[0].point.x[1]);
    EXPECT_EQ(parts[i].corner[1].point.x[1], parts[i].corner[2].point.x[1]);
  }
  EXPECT_EQ(parts[0].corner[0].point.x[1], 0);
  EXPECT_EQ(parts[1].corner[1].point.x[1], 8);
  tighten(level.view(), {}, 0, piece);
  EXPECT_EQ(piece.bound, std::sqrt(45.0) + 0.5);
}

/// Cut at the ends of the triangle that its middle is nearest to, a piece has a part within these ends.
TEST(ChooseCut, IsWhereTheNearestTriangleEnds) {
  test::Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const test::StoredLevel level(mesh);
  Piece piece = {{}, INFINITY, 0, 0, 0, false};
  piece.corner[0].point = {{0.2, 0.2, 0.1}};
  piece.corner[1].point = {{0.3, 0.2, 0.1}};
  piece.corner[2].point = {{0.2, -0.6, 0.1}};
  const Cut cut = choose_cut(piece, level.view().triangles[0], 1e-9);
  ASSERT_EQ(cut.edges, 2);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(point_of(piece, cut, i).x[1], 0, 1e-15);
  // Excursions that don't count leave the longest edge, here the one from corner 1 to 2.
  const Cut halved = choose_cut(piece, level.view().triangles[0], 0.7);
  ASSERT_EQ(halved.edges, 1);
  EXPECT_EQ(halved.edge[0], 1);
  EXPECT_EQ(halved.along[0], 0.5);
}

/// Two parallel planes and a piece across: each plane alone says 1, both together 0.5, which is right.
TEST(Tighten, MixesTriangles) {
  test::Mesh mesh;
  mesh.add({-9, -9, 0}, {9, -9, 0}, {0, 9, 0});
  mesh.add({-9, -9, 1}, {9, -9, 1}, {0, 9, 1});
  const test::StoredLevel level(mesh);
  Piece piece = {{}, INFINITY, 0, 0, 0, false};
  piece.corner[0] = {{{0, 0, 0}}, 0, 0};
  piece.corner[1] = {{{0.1, 0, 1}}, 0, 0};
  piece.corner[2] = {{{0, 0.1, 1}}, 0, 0};
  for (Corner& corner : piece.corner)
    corner.nearest = level.view().triangles[0].corner[0].position[2] == corner.point.x[2] ? 0 : 1;
  tighten(level.view(), {}, 0, piece);
  EXPECT_NEAR(piece.bound, 0.5, 1e-12);
}

}  // namespace
}  // namespace tandem::levels
