// Vertices with many triangles: what simplifiers would take cubic time for.
#include "bvhbuild/levels/collapses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "build/sample_asset.h"
#include "bvhbuild/levels/ladder.h"

namespace tandem::test {
namespace {

constexpr std::uint32_t kMostAround = 64;

/// A cone of triangles round its tip, without a base.
Mesh cone(int count) {
  Mesh mesh;
  const auto rim = [&](int i) -> std::array<float, 3> {
    const double turn = 2 * 3.14159265358979 * (i % count) / count;
    return {static_cast<float>(std::cos(turn)), static_cast<float>(std::sin(turn)), 0};
  };
  for (int i = 0; i < count; ++i) mesh.add({0, 0, 1}, rim(i), rim(i + 1));
  return mesh;
}

struct Opened {
  explicit Opened(Mesh from)
      : source(std::move(from)),
        geometry{source.points, source.triangles},
        tree(build::build_tree(geometry)),
        topology(build::make_topology(geometry, tree)),
        mesh(build::cut_open(geometry, tree, topology)) {}

  std::uint32_t most_around() const {
    std::vector<std::uint32_t> around(mesh.points.size(), 0);
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t point : triangle) ++around[point];
    return *std::max_element(around.begin(), around.end());
  }

  Mesh source;
  build::Geometry geometry;
  build::Tree tree;
  build::SurfaceTopology topology;
  build::OpenedMesh mesh;
};

TEST(CutOpen, CutsAFanIntoFansOfFewTriangles) {
  const Opened opened(cone(3000));
  EXPECT_EQ(opened.mesh.triangles.size(), 3000u);
  EXPECT_LE(opened.most_around(), kMostAround);
  EXPECT_GT(opened.mesh.fixed_vertices, 3000 / kMostAround);
  EXPECT_LT(opened.mesh.fixed_vertices, 4 * 3000 / kMostAround);
}

TEST(CutOpen, LeavesFansOfFewTrianglesWhole) {
  const Opened opened(cone(kMostAround));
  EXPECT_EQ(opened.most_around(), kMostAround);
  EXPECT_EQ(opened.mesh.fixed_vertices, 0u);
}

TEST(MakeLadder, CoarsensAConeOfManyTriangles) {
  const Opened cone_of_many(cone(3000));
  build::OptimisationWatch watch;
  const double wanted[] = {0.01};
  const build::Ladder ladder =
      build::make_ladder({cone_of_many.geometry, cone_of_many.tree, cone_of_many.topology}, wanted, watch);
  ASSERT_EQ(ladder.levels.size(), 1u);
  EXPECT_LT(ladder.levels[0].mesh.triangles.size(), 400u);
  EXPECT_LE(ladder.levels[0].error_bound, 0.01);
}

}  // namespace
}  // namespace tandem::test
