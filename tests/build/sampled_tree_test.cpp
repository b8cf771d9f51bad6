// Tests trees that are made for the mean over the samples of an animation.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "bvhbuild/tree/bounds.h"
#include "bvhbuild/tree/topology.h"
#include "bvhbuild/tree/working_tree.h"
#include "level_oracle.h"
#include "tandem/build/build_asset.h"
#include "tandem/formats/check.h"

namespace tandem::build {
namespace {

struct MovingMesh {
  std::vector<Point> points;
  std::vector<TriangleIndices> triangles;
  std::vector<std::vector<Point>> poses;

  BuiltAsset built(const BuildOptions& options = {}) const {
    OptimisationWatch watch;
    return build_asset({points, triangles, {}, 0, {}, poses}, options, "{}", watch);
  }
};

constexpr double kTurn = 4 * std::numbers::pi;

Point twisted(const Point& p, double share) {
  const double angle = share * kTurn * p[1], c = std::cos(angle), s = std::sin(angle);
  return {c * p[0] - s * p[2], p[1], s * p[0] + c * p[2]};
}

/// A flat strip, 0.5 wide and 1 long, of 2 n^2 triangles. In the poses it is twisted more and more.
MovingMesh twisting_strip(std::uint32_t n, std::size_t poses) {
  MovingMesh mesh;
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t j = 0; j <= n; ++j) mesh.points.push_back({0.5 * j / n - 0.25, 1.0 * i / n, 0});
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const std::uint32_t a = i * (n + 1) + j, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({b, d, c});
    }
  }
  for (std::size_t pose = 1; pose <= poses; ++pose) {
    std::vector<Point>& moved = mesh.poses.emplace_back();
    for (const Point& p : mesh.points)
      moved.push_back(twisted(p, static_cast<double>(pose) / static_cast<double>(poses)));
  }
  return mesh;
}

std::vector<StoredPoints> rounded(const std::vector<std::vector<Point>>& poses) {
  std::vector<StoredPoints> out;
  for (const auto& pose : poses) {
    StoredPoints& points = out.emplace_back();
    for (const Point& p : pose)
      points.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
  }
  return out;
}

double cost_in(const Topology& topology, const Geometry& geometry) {
  const std::vector<Bounds> bounds = normalized_bounds(geometry);
  const WorkingTree<Bounds> tree(topology, bounds);
  return cost_of(tree, cut_into_regions(tree, ~0u).front());
}

template <typename Bounds>
Topology made_for(const std::vector<Bounds>& bounds) {
  OptimisationWatch watch;
  Topology topology = build_minimal_tree(bounds);
  optimise(topology, bounds, Effort::standard, watch);
  return topology;
}

TEST(SampledTree, IsCheaperOnTheMeanOverPosesThanTheTreeAtRest) {
  const MovingMesh mesh = twisting_strip(40, 7);
  const std::vector<StoredPoints> poses = rounded(mesh.poses), all_points = rounded({mesh.points});
  const Geometry geometry{all_points[0], mesh.triangles, poses};
  const Topology at_rest = made_for(normalized_bounds(geometry)),
                 over_samples = made_for(normalized_samples<8>(geometry));
  double rest_cost = 0, samples_cost = 0, own_cost = 0;
  for (std::size_t sample = 0; sample < 8; ++sample) {
    const Geometry here = geometry.sample(sample);
    rest_cost += cost_in(at_rest, here);
    samples_cost += cost_in(over_samples, here);
    own_cost += cost_in(made_for(normalized_bounds(here)), here);
  }
  EXPECT_LT(samples_cost, 0.9 * rest_cost);
  EXPECT_LT(samples_cost, 1.3 * own_cost);
}

TEST(SampledTree, ItsCostIsTheSumOverTheSamples) {
  const MovingMesh mesh = twisting_strip(12, 3);
  const std::vector<StoredPoints> poses = rounded(mesh.poses), all_points = rounded({mesh.points});
  const Geometry geometry{all_points[0], mesh.triangles, poses};
  const auto bounds = normalized_samples<4>(geometry);
  const Topology topology = made_for(bounds);
  const WorkingTree<SampledBounds<4>> tree(topology, bounds);
  double sum = 0;
  for (std::size_t sample = 0; sample < 4; ++sample) sum += cost_in(topology, geometry.sample(sample));
  EXPECT_NEAR(cost_of(tree, cut_into_regions(tree, ~0u).front()), sum, 1e-5 * sum);
}

TEST(SampledTree, IsSoundForAnyNumberOfPoses) {
  for (const std::size_t poses : {1u, 3u, 4u, 7u, 8u, 15u, 16u, 63u, 64u, 80u}) {
    for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free, Imaginary{0.1}}) {
      const MovingMesh mesh = twisting_strip(5, poses);
      const BuiltAsset built = mesh.built({.imaginary = imaginary});
      const LevelView level = built.file->asset.level();
      EXPECT_EQ(test::defect_of(level), nullptr) << poses;
      EXPECT_EQ(level.triangle_count, 50u);
    }
  }
}

TEST(SampledTree, SpreadSamplesComeFirst) {
  EXPECT_EQ(spread_first(8, 4), (std::vector<std::size_t>{0, 2, 4, 6, 1, 3, 5, 7}));
  EXPECT_EQ(spread_first(3, 4), (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_EQ(spread_first(1, 4), (std::vector<std::size_t>{0}));
}

/// A book: two leaves that lie on each other at rest, and the pose opens them. Vertices 0 and 1 are the
/// spine, which the leaves share; 2 and 3 are of one leaf, 4 and 5 of the other; 6 is one more at the spine.
MovingMesh book() {
  return {{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}},
          {{0, 2, 1}, {2, 3, 1}, {6, 1, 4}, {4, 1, 5}},
          {{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, 1, 0}, {0, 0, 0}}}};
}

std::set<std::uint32_t> sources_of(const LevelView& level) {
  return {level.source_vertices, level.source_vertices + level.vertex_count};
}

TEST(SampledTree, VerticesThatPartInAPoseStayApart) {
  const BuiltAsset built = book().built();
  const LevelView level = built.file->asset.level();
  EXPECT_EQ(sources_of(level), (std::set<std::uint32_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(built.clean.vertices_welded, 1u);
  EXPECT_EQ(check(built.file->image.data(), built.file->image.size()).status, Status::kOk);

  MovingMesh still = book();
  still.poses.clear();
  const BuiltAsset welded = still.built();
  EXPECT_EQ(sources_of(welded.file->asset.level()), (std::set<std::uint32_t>{0, 1, 2, 3}));
}

TEST(SampledTree, WithoutRefitVerticesAtOnePositionAreOne) {
  const BuiltAsset built = book().built({.refit = false});
  EXPECT_EQ(built.file->asset.level().vertex_count, 4u);
  EXPECT_EQ(built.file->asset.level().source_vertices, nullptr);
}

TEST(SampledTree, OnlyTrianglesThatAreFlatInAllPosesGo) {
  MovingMesh mesh = {{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 0, 0}},
                     {{0, 1, 2}, {0, 1, 3}, {1, 4, 3}, {0, 0, 3}},
                     {{{0, 0, 0}, {1, 0, 0}, {2, 1, 0}, {0, 1, 0}, {1, 0, 1}}}};
  EXPECT_EQ(mesh.built().clean.triangles_degenerate, 1u);
  EXPECT_EQ(mesh.built().file->asset.level().triangle_count, 3u);
  mesh.poses.clear();
  EXPECT_EQ(mesh.built().clean.triangles_degenerate, 3u);
}

TEST(SampledTree, TheSameInputGivesTheSameBytesWhateverTheNumberOfThreads) {
  const MovingMesh mesh = twisting_strip(70, 7);
  const BuiltAsset one = mesh.built({.threads = 1}), four = mesh.built({.threads = 4});
  ASSERT_EQ(one.file->image.size(), four.file->image.size());
  EXPECT_EQ(std::memcmp(one.file->image.data(), four.file->image.data(), one.file->image.size()), 0);
}

}  // namespace
}  // namespace tandem::build
