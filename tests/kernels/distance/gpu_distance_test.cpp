// Distances on the GPU: certified like those of the CPU, 0 for the same pairs, and the same bytes on every
// run.
#include <gtest/gtest.h>

#include <cmath>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/asked.h"
#include "kernels/distance/distance_scenes.h"
#include "kernels/geometry/triangle_distance.h"
#include "tandem/kernels/gpu_distance_query.h"

namespace tandem {
namespace {

using test::RandomPoses;
using Distances = std::vector<ObjectDistance>;

std::vector<ObjectPair> every_pair(const BodyScene& scene, bool selves = false) {
  RandomPoses random(1);
  return test::all_pairs(scene.instances, selves, random);
}

Distances of_cpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs,
                 const DistanceOptions& options) {
  test::Asked<DistanceQuery> query;
  EXPECT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(query.find(scene.instances, pairs, options), Status::kOk);
  return {query.rows().begin(), query.rows().end()};
}

/// A scene on the GPU, and a query of it.
struct Found : test::AskedOnGpu<GpuDistanceQuery> {
  using AskedOnGpu::AskedOnGpu;

  Status find(const GpuDistanceOptions& options = {}) {
    return query.find_distances(scene.instances(), scene.pairs(), options, nullptr);
  }
  void run() { AskedOnGpu::run(GpuDistanceOptions{}); }
  Distances distances() const { return test::download(query.distances(), scene.pairs().capacity); }
};

void expect_overlap(const DistanceInterval& x, const DistanceInterval& y) {
  EXPECT_LE(x.lower, y.upper);
  EXPECT_GE(x.upper, y.lower);
}

/// The row against that of the CPU, which has no reach and the usual tolerance.
void expect_certified(const BodyScene& scene, const ObjectPair& pair, const ObjectDistance& found,
                      const ObjectDistance& truth, const DistanceTolerance& tolerance, double reach) {
  SCOPED_TRACE(std::to_string(pair.a) + " " + std::to_string(pair.b));
  expect_overlap({found.lower, found.upper}, {truth.lower, truth.upper});
  EXPECT_EQ(found.upper == 0, truth.upper == 0);
  if (found.triangle_a == kNoIndex) {
    EXPECT_GE(found.lower, reach);
    EXPECT_EQ(found.upper, INFINITY);
    EXPECT_GE(truth.upper, reach);
    return;
  }
  EXPECT_LE(found.upper - found.lower, allowed_width(tolerance, found.upper));
  const auto level = [&](std::uint32_t of) {
    return scene.assets.views()[scene.instances[of].asset].level();
  };
  ASSERT_LT(found.triangle_a, level(pair.a).triangle_count);
  ASSERT_LT(found.triangle_b, level(pair.b).triangle_count);
  EXPECT_EQ(found.face_a, level(pair.a).triangles[found.triangle_a].source_face());
  EXPECT_EQ(found.face_b, level(pair.b).triangles[found.triangle_b].source_face());
  // The triangles that are named are as near as told. Faces are numbered as the mesh's triangles are.
  const auto a = posed_triangles(scene, pair.a), b = posed_triangles(scene, pair.b);
  const TriangleDistance named =
      triangle_distance(test::pair_of(a[found.face_a], b[found.face_b]), {0, 1e-12});
  expect_overlap({found.lower, found.upper}, named.interval);
}

class GpuDistances : public test::GpuTest {};

class GpuDistanceScenes : public test::GpuTestOf<test::SceneFamily> {
 protected:
  template <class Check>
  void for_scenes(int count, Check check) {
    for_spread_scenes(GetParam(), 1147, count, check);
  }
};

INSTANTIATE_TEST_SUITE_P(All, GpuDistanceScenes, testing::ValuesIn(test::scene_families()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(GpuDistanceScenes, AreCertified) {
  for_scenes(test::trials(24, 20), [&](const BodyScene& scene, int seed) {
    const std::vector<ObjectPair> pairs = every_pair(scene, true);
    const Distances truth = of_cpu(scene, pairs, {});
    const DistanceTolerance tolerance = {seed % 3 == 1 ? 0.01 : 0, seed % 3 == 2 ? 0.1 : 1e-6};
    Found found(scene, pairs);
    for (const double reach : {static_cast<double>(INFINITY), truth[pairs.size() / 2].upper}) {
      ASSERT_EQ(found.find({.tolerance = tolerance, .reach = reach}), Status::kOk);
      const Distances distances = found.distances();
      std::uint64_t touching = 0;
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        expect_certified(scene, pairs[i], distances[i], truth[i], tolerance, reach);
        touching += distances[i].upper == 0;
      }
      EXPECT_EQ(found.report().counters.touching, touching);
      EXPECT_EQ(found.report().counters.object_pairs, pairs.size());
      EXPECT_LE(found.query.bytes(),
                most_distance_bytes(found.query.capacity(), scene.assets.views().size()));
    }
  });
}

TEST_P(GpuDistanceScenes, AreTheSameBytesOnEveryRun) {
  for_scenes(test::trials(4, 10), [&](const BodyScene& scene, int) {
    Found found(scene, every_pair(scene));
    ASSERT_EQ(found.find(), Status::kOk);
    const Distances first = found.distances();
    const GpuDistanceReport report = found.report();
    for (int i = 0; i < 8; ++i) {
      ASSERT_EQ(found.find(), Status::kOk);
      EXPECT_TRUE(same_bytes(found.distances(), first));
      EXPECT_EQ(found.report().counters, report.counters);
    }
  });
}

/// The narrow walk is as wide for so many pairs as for one, so what is found of one does not depend on the
/// others.
TEST_P(GpuDistanceScenes, ReachesOfPairsFindWhatSingleCallsFind) {
  constexpr std::size_t kAlike = 16;
  for_scenes(test::trials(8, 10), [&](const BodyScene& scene, int) {
    std::vector<ObjectPair> pairs = every_pair(scene, true);
    if (pairs.size() > kAlike) pairs.resize(kAlike);
    const std::vector<double> reaches = mixed_reaches(of_cpu(scene, pairs, {}));
    const GpuArray<double> reach_of_pair = test::on_gpu(reaches);
    Found found(scene, pairs);
    ASSERT_EQ(found.find({.reach = 0, .reach_of_pair = reach_of_pair.data()}), Status::kOk);
    const Distances together = found.distances();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      ASSERT_EQ(found.find({.reach = reaches[i]}), Status::kOk);
      EXPECT_TRUE(same_bytes(std::span(&found.distances()[i], 1), std::span(&together[i], 1)))
          << i << " within " << reaches[i];
    }
  });
}

TEST_F(GpuDistances, OfManyPairsAreCertified) {
  const BodyScene scene = spread_out(crowd(5, 300), 3);
  const std::vector<ObjectPair> pairs = every_pair(scene);
  const Distances truth = of_cpu(scene, pairs, {});
  Found found(scene, pairs);
  ASSERT_EQ(found.find(), Status::kOk);
  const Distances distances = found.distances();
  for (std::size_t i = 0; i < pairs.size() && !HasFailure(); ++i)
    expect_certified(scene, pairs[i], distances[i], truth[i], {}, INFINITY);
  // Distances of a step ago lead to the same.
  ASSERT_EQ(found.find({.former = found.query.distances()}), Status::kOk);
  const Distances again = found.distances();
  for (std::size_t i = 0; i < pairs.size() && !HasFailure(); ++i)
    expect_certified(scene, pairs[i], again[i], truth[i], {}, INFINITY);
  // Each within a reach of its own.
  const std::vector<double> reaches = mixed_reaches(truth);
  const GpuArray<double> reach_of_pair = test::on_gpu(reaches);
  ASSERT_EQ(found.find({.reach_of_pair = reach_of_pair.data()}), Status::kOk);
  const Distances within = found.distances();
  for (std::size_t i = 0; i < pairs.size() && !HasFailure(); ++i)
    expect_certified(scene, pairs[i], within[i], truth[i], {}, reaches[i]);
}

TEST_F(GpuDistances, OfOneLargePair) {
  RandomPoses random(8);
  BodyScene scene;
  scene.assets.add(test::cube(0.5f, 120));  // 172,800 triangles
  scene.assets.add(test::soup(random, 100'000, 0.01));
  scene.instances = {{0, at(0, 0, 0)}, {1, at(1.52, 0.3, -0.2)}, {0, at(3.5, 0, 0)}, {0, at(0.4, 0.1, 0.2)}};
  const std::vector<ObjectPair> pairs = {{0, 1}, {2, 0}, {1, 1}, {0, 3}};
  const Distances truth = of_cpu(scene, pairs, {});
  Found found(scene, pairs);
  ASSERT_EQ(found.find(), Status::kOk);
  const Distances distances = found.distances();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    expect_overlap({distances[i].lower, distances[i].upper}, {truth[i].lower, truth[i].upper});
    EXPECT_EQ(distances[i].upper == 0, truth[i].upper == 0);
  }
  EXPECT_EQ(found.report().counters.touching, 2u);
}

/// Cubes that nearly touch, one with coordinates that differ in size by 2^-400: exact arithmetic needs more
/// words than there is room for at first.
TEST_F(GpuDistances, WhatNeedsWiderNumbersIsToldAndGetsThem) {
  BodyScene scene;
  scene.assets.add(test::cube(0.5f, 2));
  scene.instances = {{0, at(0, 0, 0)}, {0, at(1 + 0x1p-52, 0x1p-400, 0)}};
  const std::vector<ObjectPair> pairs = {{0, 1}};
  const Distances truth = of_cpu(scene, pairs, {});
  ASSERT_GT(truth[0].lower, 0);
  Found found(scene, pairs);
  ASSERT_EQ(found.query.reserve({1, 1u << 12, 1u << 12, 1u << 10, kFewWords}), Status::kOk);
  found.run();
  EXPECT_EQ(found.report().complete, 0u);
  EXPECT_GT(found.report().needed.words, kFewWords);
  ASSERT_EQ(found.find(), Status::kOk);
  EXPECT_EQ(found.report().complete, 1u);
  expect_certified(scene, pairs[0], found.distances()[0], truth[0], {}, INFINITY);
}

TEST_F(GpuDistances, WhatDoesNotFitIsToldAndNothingIsLostOnTheRetry) {
  const BodyScene scene = spread_out(crowd(3, 60), 1.2);
  const std::vector<ObjectPair> pairs = every_pair(scene);
  Found found(scene, pairs);
  ASSERT_EQ(found.find(), Status::kOk);
  const Distances expected = found.distances();
  const GpuDistanceCapacity needed = found.report().needed;
  ASSERT_GT(needed.settled, 1u);
  for (std::uint32_t GpuDistanceCapacity::*const member :
       {&GpuDistanceCapacity::pairs, &GpuDistanceCapacity::block_pairs, &GpuDistanceCapacity::triangle_pairs,
        &GpuDistanceCapacity::settled}) {
    GpuDistanceCapacity small = needed;
    small.*member -= 1;
    Found tight(scene, pairs);
    ASSERT_EQ(tight.query.reserve(small), Status::kOk);
    tight.run();
    EXPECT_EQ(tight.report().complete, 0u);
    EXPECT_GE(tight.report().needed.*member, needed.*member);
    ASSERT_EQ(tight.query.reserve(needed), Status::kOk);
    tight.run();
    EXPECT_EQ(tight.report().complete, 1u);
    EXPECT_TRUE(same_bytes(tight.distances(), expected));
  }
}

/// The number of pairs lies in GPU memory, and so do their reaches: a graph follows both.
TEST_F(GpuDistances, AGraphFollowsTheNumberOfPairsAndTheirReaches) {
  BodyScene scene = row_of_cubes(3);
  for (int i = 0; i < 3; ++i) scene.instances[i].pose.translation[0] = 1.25 * i;
  const std::vector<ObjectPair> pairs = {{0, 1}, {1, 2}, {0, 2}};  // 0.25, 0.25 and 1.5 apart
  GpuArray<std::uint32_t> count = test::on_gpu(std::vector<std::uint32_t>{0});
  GpuArray<double> reach_of_pair = test::on_gpu(std::vector<double>{0, 0, 0});
  Found found(scene, pairs);
  ASSERT_EQ(found.query.reserve({3, 1u << 12, 1u << 12, 1u << 10, 0}), Status::kOk);
  test::GraphStream stream;
  stream.capture([&] {
    return found.query.enqueue(found.scene.instances(), {found.scene.pairs().pairs, count.data(), 3},
                               {.reach_of_pair = reach_of_pair.data()}, stream.get());
  });
  const std::vector<std::vector<double>> calls = {{}, {0.2, 1, 1}, {1, 0.2}, {0.5}, {1, 1, 2}, {}};
  for (const std::vector<double>& reaches : calls) {
    const std::vector<std::uint32_t> number = {static_cast<std::uint32_t>(reaches.size())};
    ASSERT_EQ(count.upload(number, stream.get()), cudaSuccess);
    ASSERT_EQ(reach_of_pair.upload(reaches, stream.get()), cudaSuccess);
    stream.launch();
    const GpuDistanceReport& report = found.report();
    EXPECT_EQ(report.status, Status::kOk);
    EXPECT_EQ(report.complete, 1u);
    EXPECT_EQ(report.needed.pairs, number[0]);
    EXPECT_EQ(report.counters.object_pairs, number[0]);
    if (reaches.empty()) {
      const GpuDistanceCapacity& needed = report.needed;
      EXPECT_EQ(needed.block_pairs + needed.triangle_pairs + needed.settled, 0u);
    }
    const Distances distances = found.distances();
    for (std::size_t i = 0; i < reaches.size(); ++i) {
      const double gap = i == 2 ? 1.5 : 0.25;
      if (reaches[i] > gap)
        expect_overlap({distances[i].lower, distances[i].upper}, {gap, gap});
      else
        EXPECT_TRUE(distances[i].triangle_a == kNoIndex && distances[i].lower >= reaches[i]) << i;
    }
  }
}

TEST_F(GpuDistances, AGraphFollowsTheBodies) {
  BodyScene scene = row_of_cubes(2);
  const std::vector<ObjectPair> pairs = {{1, 0}};
  GpuArray<Pose> poses;
  GpuArray<std::uint32_t> assets = test::on_gpu(std::vector<std::uint32_t>{0, 0});
  ASSERT_EQ(poses.reserve(2), cudaSuccess);
  Found found(scene, pairs);
  ASSERT_EQ(found.query.reserve({1, 1u << 12, 1u << 12, 1u << 10, 0}), Status::kOk);
  test::GraphStream stream;
  stream.capture([&] {
    return found.query.enqueue({assets.data(), poses.data(), 2}, found.scene.pairs(), {.reach = 4},
                               stream.get());
  });
  for (const double gap : {0.5, 0.0, 3.0, 5.0, 0.25}) {
    std::vector<Pose> moved = {scene.instances[0].pose, scene.instances[0].pose};
    moved[1].translation[0] += 1 + gap;
    ASSERT_EQ(poses.upload(moved, stream.get()), cudaSuccess);
    stream.launch();
    const ObjectDistance distance = found.distances()[0];
    if (gap < 4) {
      expect_overlap({distance.lower, distance.upper}, {gap, gap});
    } else {
      EXPECT_TRUE(distance.upper == INFINITY && distance.lower >= 4);
    }
  }
}

TEST_F(GpuDistances, ErrorsAreNamed) {
  const BodyScene scene = row_of_cubes(3);
  const auto status_of = [](const BodyScene& wrong, const std::vector<ObjectPair>& pairs,
                            std::uint64_t where) {
    Found found(wrong, pairs);
    const Status status = found.find();
    EXPECT_EQ(found.report().where, where);
    return status;
  };
  EXPECT_EQ(status_of(scene, {{0, 1}, {0, 3}}, 1), Status::kUnknownInstance);
  BodyScene wrong = row_of_cubes(3);
  wrong.instances[1].pose.rotation[0][0] = 2;
  EXPECT_EQ(status_of(wrong, {{0, 2}}, 1), Status::kPoseNotRigid);
  wrong.instances[1] = {7, kIdentityPose};
  EXPECT_EQ(status_of(wrong, {{0, 1}}, 1), Status::kUnknownAsset);
  wrong.instances[1] = {0, at(2e300, 0, 0)};
  EXPECT_EQ(status_of(wrong, {{0, 1}}, 1), Status::kOutOfRange);
  Found found(scene, {{0, 1}});
  EXPECT_EQ(found.find({.reach = -1}), Status::kBadReach);
  EXPECT_EQ(found.find({.tolerance = {0, NAN}}), Status::kBadTolerance);
  EXPECT_EQ(found.find(), Status::kOk);
  Found of_three(scene, {{0, 1}, {2, 2}, {1, 2}});
  for (const double bad : {-1.0, static_cast<double>(NAN)}) {
    const GpuArray<double> reach_of_pair = test::on_gpu(std::vector<double>{1, bad, bad});
    EXPECT_EQ(of_three.find({.reach_of_pair = reach_of_pair.data()}), Status::kBadReach);
    EXPECT_EQ(of_three.report().where, 1u);
  }
  test::expect_needed<GpuDistanceQuery>(scene, Contents::exact_queries, Status::kNoAxisAlignedBlocks);
}

}  // namespace
}  // namespace tandem
