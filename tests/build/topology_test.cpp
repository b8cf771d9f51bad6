// How bvhbuild finds that triangles hang together, and which side of them is outside.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "level_oracle.h"
#include "sample_asset.h"

namespace tandem::test {
namespace {

using Point = std::array<float, 3>;

/// A box whose triangles go round against the clock as seen from outside.
void add_box(Mesh& mesh, const Point& lower, const Point& upper, bool inside_out = false) {
  const auto corner = [&](int i) {
    return Point{(i & 1) != 0 ? upper[0] : lower[0], (i & 2) != 0 ? upper[1] : lower[1],
                 (i & 4) != 0 ? upper[2] : lower[2]};
  };
  constexpr int kFaces[][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                               {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : kFaces) {
    for (const int k : {1, 2}) {
      const int a = f[k], b = f[k + 1];
      mesh.add(corner(f[0]), corner(inside_out ? b : a), corner(inside_out ? a : b));
    }
  }
}

void turn(Mesh& mesh, std::size_t triangle) {
  std::swap(mesh.triangles[triangle][1], mesh.triangles[triangle][2]);
}

/// A sound file of the mesh, and its level.
struct Made {
  explicit Made(const Mesh& mesh)
      : file(make_file(mesh, build::Imaginary::minimal, build::Effort::fast)), result(file.check()) {
    EXPECT_EQ(result.status, Status::kOk) << name(result.status) << " " << result.where;
    if (result.status != Status::kOk) return;
    level = result.asset.level();
    EXPECT_EQ(defect_of_topology(level), nullptr) << defect_of_topology(level);
  }
  /// Whether the triangle of the mesh is turned. Source face i is triangle i.
  bool is_turned(std::uint32_t face) const {
    std::uint32_t t = 0;
    while (level.triangles[t].source_face() != face) ++t;
    return tandem::is_turned(level.topology[t].flags);
  }
  std::uint32_t turned() const {
    std::uint32_t count = 0;
    for (std::uint32_t t = 0; t < level.triangle_count; ++t)
      count += tandem::is_turned(level.topology[t].flags);
    return count;
  }
  std::uint32_t sides(bool (*has)(std::uint32_t, int)) const {
    std::uint32_t count = 0;
    for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
      for (int k = 0; k < 3; ++k) count += has(level.topology[t].flags, k);
    }
    return count;
  }

  Bytes file;
  CheckResult result;
  LevelView level;
};

TEST(Topology, OfABoxIsClosedAndHasEightVertices) {
  Mesh mesh;
  add_box(mesh, {0, 0, 0}, {1, 2, 3});
  const Made made(mesh);
  EXPECT_EQ(made.level.vertex_count, 8u);
  EXPECT_EQ(made.level.component_count, 1u);
  EXPECT_TRUE(made.level.closed);
  EXPECT_EQ(made.turned(), 0u);
  EXPECT_EQ(made.sides(is_boundary) + made.sides(has_many_triangles), 0u);
}

TEST(Topology, MinusZeroIsZero) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.add({-0.0f, 0, -0.0f}, {0, 1, 0}, {0, -0.0f, 1});
  const Made made(mesh);
  EXPECT_EQ(made.level.vertex_count, 4u);
  EXPECT_EQ(made.level.component_count, 1u);
  EXPECT_EQ(made.sides(is_boundary), 4u);
}

TEST(Topology, ThreeTrianglesAtAnEdgeAreMany) {
  Mesh mesh;
  for (const Point& tip : {Point{0, 1, 0}, Point{0, 0, 1}, Point{0, -1, -1}})
    mesh.add({0, 0, 0}, {1, 0, 0}, tip);
  const Made made(mesh);
  EXPECT_EQ(made.sides(has_many_triangles), 3u);
  EXPECT_EQ(made.sides(is_boundary), 6u);
  EXPECT_EQ(made.level.component_count, 1u);
  EXPECT_FALSE(made.level.closed);
}

TEST(Topology, TwoBoxesAtAnEdgeAreOneClosedComponent) {
  Mesh mesh;
  add_box(mesh, {0, 0, 0}, {1, 1, 1});
  add_box(mesh, {1, 1, 0}, {2, 2, 1});
  const Made made(mesh);
  EXPECT_EQ(made.level.component_count, 1u);
  EXPECT_TRUE(made.level.closed);
  EXPECT_EQ(made.sides(has_many_triangles), 4u);
}

TEST(Topology, ASideWithoutLengthJoinsNothing) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {0, 0, 0}, {1, 0, 0});
  mesh.add({2, 2, 2}, {2, 2, 2}, {2, 2, 2});
  mesh.add({2, 2, 2}, {3, 2, 2}, {2, 3, 2});
  const Made made(mesh);
  EXPECT_EQ(made.level.component_count, 3u);
  EXPECT_EQ(made.sides(is_boundary), 3u);  // those of the last triangle
}

// Any windings of a box: the turned ones are those that were exchanged.
TEST(Topology, FindsTheTrianglesThatAreWoundTheOtherWay) {
  std::mt19937 random(1);
  for (int round = 0; round < 50; ++round) {
    Mesh mesh;
    add_box(mesh, {-1, -2, -1}, {1, 1, 3});
    std::vector<bool> wrong(mesh.triangles.size());
    for (std::size_t t = 0; t < wrong.size(); ++t) {
      wrong[t] = random() % 2 == 0;
      if (wrong[t]) turn(mesh, t);
    }
    const Made made(mesh);
    EXPECT_TRUE(made.level.closed);
    for (std::uint32_t t = 0; t < wrong.size(); ++t) EXPECT_EQ(made.is_turned(t), wrong[t]) << t;
  }
}

// Nothing joins the windings of the two boxes: each keeps that of its larger part.
TEST(Topology, TheLargerPartIsThatOfWhatEdgesOfTwoTrianglesJoin) {
  std::mt19937 random(4);
  for (int round = 0; round < 20; ++round) {
    Mesh mesh;
    add_box(mesh, {0, 0, 0}, {1, 1, 1});
    add_box(mesh, {1, 1, 0}, {2, 2, 1});
    std::vector<bool> wrong(24);
    for (std::size_t t = random() % 3; t < 24; t += 3 + random() % 2) {
      wrong[t] = true;
      turn(mesh, t);
    }
    const Made made(mesh);
    EXPECT_TRUE(made.level.closed);
    for (std::uint32_t t = 0; t < 24; ++t) EXPECT_EQ(made.is_turned(t), wrong[t]) << t;
  }
}

TEST(Topology, AnOpenSheetKeepsTheWindingOfItsLargerPart) {
  Mesh mesh;
  for (int i = 0; i < 5; ++i) {
    const auto x = static_cast<float>(i);
    mesh.add({x, 0, 0}, {x + 1, 0, 0}, {x, 1, 0});
    mesh.add({x + 1, 0, 0}, {x + 1, 1, 0}, {x, 1, 0});
  }
  for (const std::size_t t : {2u, 3u, 7u}) turn(mesh, t);
  const Made made(mesh);
  EXPECT_FALSE(made.level.closed);
  EXPECT_EQ(made.level.component_count, 1u);
  for (std::uint32_t t = 0; t < 10; ++t) EXPECT_EQ(made.is_turned(t), t == 2 || t == 3 || t == 7);
}

// A ring of five with half a twist, and a grid whose sides are joined to a Klein bottle.
TEST(Topology, WhatCannotBeOrientedIsOpen) {
  Mesh ring;
  for (int i = 0; i < 5; ++i) {
    const auto at = [](int step, float side) {
      const double around = 2 * 3.14159265358979 * (step % 5) / 5, tilt = 3.14159265358979 * (step % 5) / 5;
      const double way = step == 5 ? -side : side, r = 3 + way * std::cos(tilt);
      return Point{static_cast<float>(r * std::cos(around)), static_cast<float>(r * std::sin(around)),
                   static_cast<float>(way * std::sin(tilt))};
    };
    ring.add(at(i, -1), at(i + 1, -1), at(i, 1));
    ring.add(at(i + 1, -1), at(i + 1, 1), at(i, 1));
  }
  const Made strip(ring);
  EXPECT_EQ(strip.level.component_count, 1u);
  EXPECT_EQ(strip.sides(is_boundary), 10u);
  EXPECT_EQ(strip.level.vertex_count, 10u);
  EXPECT_FALSE(strip.level.closed);

  constexpr int kSize = 4;
  Mesh bottle;
  const auto at = [](int i, int j) {
    if (i == kSize) i = 0, j = kSize - j;
    j %= kSize;
    return Point{static_cast<float>(i), static_cast<float>(j), static_cast<float>(i * j % 3)};
  };
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) {
      bottle.add(at(i, j), at(i + 1, j), at(i, j + 1));
      bottle.add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  const Made klein(bottle);
  EXPECT_EQ(klein.level.component_count, 1u);
  EXPECT_EQ(klein.sides(is_boundary), 0u);
  EXPECT_FALSE(klein.level.closed);
}

TEST(Topology, ClosedComponentsThatAreInsideOutAreTurnedUnlessTheyAreCavities) {
  for (const bool outer_inside_out : {false, true}) {
    Mesh mesh;
    add_box(mesh, {0, 0, 0}, {10, 10, 10}, outer_inside_out);  // triangles 0 to 11
    add_box(mesh, {1, 1, 1}, {4, 4, 4}, true);                 // a cavity
    add_box(mesh, {5, 5, 5}, {9, 9, 9});                       // another body
    add_box(mesh, {20, 0, 0}, {21, 1, 1}, true);               // beside
    mesh.add({30, 0, 0}, {31, 0, 0}, {30, 1, 0});              // open
    const Made made(mesh);
    EXPECT_FALSE(made.level.closed);
    EXPECT_EQ(made.level.component_count, 5u);
    for (std::uint32_t t = 0; t < 49; ++t) {
      const std::uint32_t box = t / 12;
      EXPECT_EQ(made.is_turned(t), box == 0 ? outer_inside_out : box == 3) << t;
    }
  }
}

// A cavity that touches the wall from inside is one still; a box that touches others from outside is none.
TEST(Topology, TouchingDecidesNothing) {
  Mesh mesh;
  add_box(mesh, {0, 0, 0}, {10, 10, 10});
  add_box(mesh, {0, 2, 2}, {4, 4, 4}, true);
  EXPECT_EQ(Made(mesh).turned(), 0u);

  Mesh row;
  add_box(row, {0, 0, 0}, {1, 1, 1});
  add_box(row, {1, 0.25f, 0.25f}, {2, 0.75f, 0.75f}, true);
  add_box(row, {2, 0, 0}, {3, 1, 1});
  const Made made(row);
  for (std::uint32_t t = 0; t < 36; ++t) EXPECT_EQ(made.is_turned(t), t / 12 == 1);
}

// Thousands of small bodies that are inside out, in a large one and beside it.
TEST(Topology, ManySmallComponentsAreToldApart) {
  std::mt19937 random(2);
  const auto uniform = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  Mesh mesh;
  add_box(mesh, {0, 0, 0}, {1, 1, 1});
  constexpr std::uint32_t kSmall = 2000;
  for (std::uint32_t i = 0; i < kSmall; ++i) {
    const Point at = {1.9f * uniform() + 0.01f, 0.01f + 0.97f * uniform(), 0.01f + 0.97f * uniform()};
    const float x = at[0] > 0.97f && at[0] < 1 ? 1.01f : at[0];
    add_box(mesh, {x, at[1], at[2]}, {x + 0.002f, at[1] + 0.002f, at[2] + 0.002f}, true);
  }
  const build::Tree tree = build::build_tree(mesh.geometry(), build::Imaginary::minimal, build::Effort::fast);
  const build::SurfaceTopology surface = build::make_topology(mesh.geometry(), tree);
  EXPECT_GT(surface.components.size(), kSmall * 9 / 10);  // few share an edge
  std::uint32_t cavities = 0;
  for (std::uint32_t t = 0; t < tree.order.size(); ++t) {
    const std::uint32_t source = tree.order[t];
    const float x = mesh.points[mesh.triangles[source][0]][0];
    EXPECT_EQ(is_turned(surface.triangles[t].flags), source >= 12 && x > 1) << source;
    cavities += source >= 12 && x < 1;
  }
  EXPECT_GT(cavities, 12 * kSmall / 3);
}

// Triangles between few points: many at an edge, flat ones, the same one twice.
TEST(Topology, IsWhatMapsOfPositionsAndEdgesFind) {
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    const auto coordinate = [&, most = 2 + round % 4] {
      return static_cast<float>(static_cast<int>(random() % most) - 1);
    };
    const auto point = [&] {
      const float x = coordinate(), y = coordinate();
      return Point{x, y, coordinate()};
    };
    Mesh mesh;
    const int triangles = 1 + static_cast<int>(random() % 60);
    for (int t = 0; t < triangles; ++t) {
      const Point a = point(), b = point();
      mesh.add(a, b, point());
    }
    const Made made(mesh);
    ASSERT_FALSE(HasFailure()) << round;
  }
}

TEST(Topology, OfSharedPointsIsThatOfPointsOfTheirOwn) {
  Mesh apart;
  add_box(apart, {0, 0, 0}, {1, 1, 1});
  Mesh shared;
  for (const auto& triangle : apart.triangles) {
    auto& out = shared.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto found = std::find(shared.points.begin(), shared.points.end(), apart.points[triangle[k]]);
      out[k] = static_cast<std::uint32_t>(found - shared.points.begin());
      if (found == shared.points.end()) shared.points.push_back(apart.points[triangle[k]]);
    }
  }
  EXPECT_EQ(shared.points.size(), 8u);
  const build::Image one = make_file(apart), other = make_file(shared);
  ASSERT_EQ(one.size(), other.size());
  EXPECT_EQ(std::memcmp(one.data(), other.data(), one.size()), 0);
}

}  // namespace
}  // namespace tandem::test
