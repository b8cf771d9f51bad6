// Levels of detail on a GPU: contacts with the levels' errors, and verdicts by tolerance, are the CPU's.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/asked.h"
#include "kernels/tolerance/level_scenes.h"
#include "tandem/kernels/gpu_tolerance_query.h"

namespace tandem {
namespace {

using test::all_pairs;
using test::BodyScene;
using test::download;
using test::GpuScene;
using test::LevelViews;
using test::RandomPoses;
using test::sorted;

class GpuTolerance : public test::GpuTest {};

/// A tolerance query about the levels of a scene.
struct AskedLevels {
  AskedLevels(const BodyScene& of, const std::vector<ObjectPair>& pairs, cudaStream_t stream = nullptr)
      : scene(of.assets, of.instances, pairs, Contents::exact_queries) {
    EXPECT_EQ(query.set_assets(scene.levels(), stream), Status::kOk);
  }
  Status decide(double tolerance, cudaStream_t stream = nullptr) {
    return query.decide(scene.instances(), scene.pairs(), tolerance, stream);
  }
  Status enqueue(double tolerance, cudaStream_t stream = nullptr) {
    return query.enqueue(scene.instances(), scene.pairs(), tolerance, stream);
  }
  std::vector<PairVerdict> verdicts() const { return download(query.verdicts(), scene.pairs().capacity); }
  const GpuToleranceReport& report() const { return query.report(); }

  GpuScene scene;
  GpuToleranceQuery query;
};

/// Instances at random levels, by place among the views of single levels.
std::vector<Instance> at_any_levels(const BodyScene& scene, const LevelViews& views, RandomPoses& random) {
  std::vector<Instance> out = scene.instances;
  for (Instance& instance : out) {
    const std::size_t count = scene.assets.views()[instance.asset].levels.size();
    instance.asset = views.first[instance.asset] + static_cast<std::uint32_t>(random.below(count));
  }
  return out;
}

void expect_cpus_contacts(const LevelViews& views, const std::vector<Instance>& bodies,
                          const std::vector<ObjectPair>& pairs, double within, std::uint64_t& world_pairs) {
  test::Asked<ContactQuery> cpu;
  ASSERT_EQ(cpu.set_assets(views.views), Status::kOk);
  const GpuScene device(views.views, bodies, pairs);
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(device.assets(), nullptr), Status::kOk);
  for (const QueryMode mode : test::kModes) {
    SCOPED_TRACE(testing::Message() << "mode " << static_cast<int>(mode) << " within " << within);
    ASSERT_EQ(cpu.find(bodies, pairs, {.mode = mode, .within = within, .add_error_bounds = true}),
              Status::kOk);
    GpuContactOptions options = test::gpu_options(mode);
    options.within = within;
    options.add_error_bounds = true;
    ASSERT_EQ(query.find_contacts(device.instances(), device.pairs(), options, nullptr), Status::kOk);
    EXPECT_EQ(sorted(download(query.contacts(), query.report().contacts)),
              sorted({cpu.rows().begin(), cpu.rows().end()}));
    EXPECT_LE(query.bytes(), most_query_bytes(query.capacity(), options, views.views.size()));
    world_pairs += query.report().world_pairs;
  }
}

TEST_F(GpuTolerance, ContactsAtLevelsAreTheCpus) {
  std::uint64_t world_pairs = 0;
  for (int trial = 0; trial < test::trials(120, 20) && !HasFailure(); ++trial) {
    RandomPoses random(4711 + static_cast<std::uint64_t>(trial));
    const BodyScene scene = test::any_level_scene(random);
    const LevelViews views(scene.assets.views());
    const double within = random.below(2) == 0 ? 0 : 0.2 * test::any_distance(random, scene);
    SCOPED_TRACE(testing::Message() << "trial " << trial << '\n' << test::text(scene));
    expect_cpus_contacts(views, at_any_levels(scene, views, random),
                         all_pairs(scene.instances, trial % 2 == 0, random), within, world_pairs);
  }
  EXPECT_EQ(world_pairs, 0u);
}

TEST_F(GpuTolerance, ContactsAtLevelsBeyondFloat32AreTheCpus) {
  std::uint64_t world_pairs = 0;
  for (int trial = 0; trial < 10 && !HasFailure(); ++trial) {
    RandomPoses random(99 + static_cast<std::uint64_t>(trial));
    BodyScene scene;
    test::Mesh mesh = test::soup(random, 6, 0.7);
    test::scale(mesh, 1e37);
    test::add_levels(scene.assets, test::split_levels(mesh, 3, 1e36, random));
    for (int i = 0; i < 3; ++i) scene.instances.push_back({0, random.pose({1, 1, 1e37, 0, 4})});
    const LevelViews views(scene.assets.views());
    expect_cpus_contacts(views, at_any_levels(scene, views, random), all_pairs(scene.instances, true, random),
                         0, world_pairs);
  }
  EXPECT_GT(world_pairs, 0u);
}

/// Runs decide() of both and expects the same of them.
void expect_cpus_verdicts(const BodyScene& scene, const std::vector<ObjectPair>& pairs,
                          const GpuScene& device, GpuToleranceQuery& query, double tolerance) {
  test::Asked<ToleranceQuery> cpu;
  ASSERT_EQ(cpu.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(cpu.find(scene.instances, pairs, {.tolerance = tolerance}), Status::kOk);
  ASSERT_EQ(query.decide(device.instances(), device.pairs(), tolerance, nullptr), Status::kOk)
      << cudaGetErrorString(query.cuda_error());
  const std::vector<PairVerdict> verdicts = download(query.verdicts(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(verdicts[i], cpu.rows()[i])
        << "pair " << i << ": " << static_cast<int>(verdicts[i].verdict) << " at " << int{verdicts[i].level_a}
        << ", " << int{verdicts[i].level_b} << ", not " << static_cast<int>(cpu.rows()[i].verdict);
  }
  const ToleranceCounters &found = query.report().counters, &expected = cpu.counters();
  EXPECT_EQ(found.apart, expected.apart);
  EXPECT_EQ(found.touching, expected.touching);
  EXPECT_EQ(found.within_tolerance, expected.within_tolerance);
  EXPECT_LE(query.bytes(), most_tolerance_bytes(query.capacity(), device.levels().size()));
}

TEST_F(GpuTolerance, VerdictsAreTheCpus) {
  GpuToleranceQuery query;
  for (int trial = 0; trial < test::trials(150, 20) && !HasFailure(); ++trial) {
    RandomPoses random(815 + static_cast<std::uint64_t>(trial));
    const BodyScene scene = test::any_level_scene(random);
    const auto pairs = all_pairs(scene.instances, trial % 2 == 0, random);
    const GpuScene device(scene.assets, scene.instances, pairs, Contents::exact_queries);
    ASSERT_EQ(query.set_assets(device.levels(), nullptr), Status::kOk);
    const AssetView& asset = scene.assets.views()[random.below(2)];
    const double error = asset.levels[random.below(asset.levels.size())].error_bound;
    for (const double tolerance : {0.0, 4.1 * error, test::any_distance(random, scene)}) {
      SCOPED_TRACE(testing::Message() << "trial " << trial << " tolerance " << tolerance << '\n'
                                      << test::text(scene));
      expect_cpus_verdicts(scene, pairs, device, query, tolerance);
    }
  }
}

/// Balls and soups of four levels, close enough to meet.
BodyScene pile_of_levels(std::uint32_t bodies, double spread, std::uint64_t seed) {
  RandomPoses random(seed);
  BodyScene scene;
  test::add_levels(scene.assets, test::split_levels(test::cube(0.5f, 3), 4, 0.003, random));
  test::add_levels(scene.assets, test::split_levels(test::soup(random, 40, 0.3), 3, 0.01, random));
  for (std::uint32_t i = 0; i < bodies; ++i)
    scene.instances.push_back({i % 2, random.pose({1, 1, spread, 0, 4})});
  return scene;
}

TEST_F(GpuTolerance, OfAPileIsTheCpusAtEveryTolerance) {
  RandomPoses random(3);
  const BodyScene scene = pile_of_levels(80, 4, 7);
  const auto pairs = all_pairs(scene.instances, false, random);
  AskedLevels gpu(scene, pairs);
  std::uint64_t certain = 0;
  for (const double tolerance : {0.2, 0.05, 0.02, 1e-3, 0.0}) {
    expect_cpus_verdicts(scene, pairs, gpu.scene, gpu.query, tolerance);
    const ToleranceCounters& counters = gpu.report().counters;
    EXPECT_GE(counters.apart + counters.touching, certain) << "a smaller tolerance leaves less open";
    certain = counters.apart + counters.touching;
  }
  EXPECT_EQ(certain, pairs.size());
}

TEST_F(GpuTolerance, IsTheSameOnEveryRunOfAGraph) {
  RandomPoses random(4);
  const BodyScene scene = pile_of_levels(80, 4, 8);
  const auto pairs = all_pairs(scene.instances, false, random);
  test::GraphStream stream;
  AskedLevels gpu(scene, pairs, stream.get());
  ASSERT_EQ(gpu.decide(0.02, stream.get()), Status::kOk);
  const std::vector<PairVerdict> expected = gpu.verdicts();
  const std::uint64_t within = gpu.report().counters.within_tolerance;
  EXPECT_GT(within, 0u);
  stream.capture([&] { return gpu.enqueue(0.02, stream.get()); });
  for (int run = 0; run < 5; ++run) {
    stream.launch();
    EXPECT_EQ(gpu.report().complete, 1u);
    EXPECT_EQ(gpu.report().counters.within_tolerance, within);
    EXPECT_EQ(gpu.verdicts(), expected);
  }
}

TEST_F(GpuTolerance, WhatDoesNotFitIsAskedFor) {
  RandomPoses random(5);
  const BodyScene scene = pile_of_levels(60, 3, 9);
  const auto pairs = all_pairs(scene.instances, false, random);
  AskedLevels gpu(scene, pairs);
  const auto count = static_cast<std::uint32_t>(scene.instances.size());
  ASSERT_EQ(gpu.query.reserve({count - 1, 10, 0}), Status::kOk);
  EXPECT_EQ(gpu.enqueue(0), Status::kOutOfRange);
  for (const std::uint32_t room : {10u, static_cast<std::uint32_t>(pairs.size())}) {
    ASSERT_EQ(gpu.query.reserve({count, room, 1}), Status::kOk);
    ASSERT_EQ(gpu.enqueue(0), Status::kOk);
    ASSERT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
    EXPECT_EQ(gpu.report().status, Status::kOk);
    EXPECT_EQ(gpu.report().complete, 0u);
    EXPECT_EQ(gpu.report().needed.pairs, pairs.size());
    EXPECT_EQ(gpu.report().needed.instances, count);
  }
  EXPECT_GT(gpu.report().needed.undecided, 1u);
  expect_cpus_verdicts(scene, pairs, gpu.scene, gpu.query, 0);
}

TEST_F(GpuTolerance, WhatIsWrongIsSaid) {
  BodyScene scene = pile_of_levels(4, 1, 10);
  const std::vector<ObjectPair> pairs = {{0, 1}, {1, 2}, {2, 3}};
  {
    AskedLevels gpu(scene, pairs);
    const auto levels = gpu.scene.levels();
    EXPECT_EQ(gpu.query.set_assets(levels.subspan(1), nullptr), Status::kNoFinestLevel);
    EXPECT_EQ(gpu.query.set_assets(std::vector<GpuAsset>{levels[0], levels[2]}, nullptr),
              Status::kNoFinestLevel);
    std::vector<GpuAsset> of_two = {levels[0], levels[1]};
    of_two[1].lower[0] -= 1;
    EXPECT_EQ(gpu.query.set_assets(of_two, nullptr), Status::kNoFinestLevel);
    ASSERT_EQ(gpu.query.set_assets(levels, nullptr), Status::kOk);
    for (const double bad : {-1.0, std::nan(""), HUGE_VAL, 1e301})
      EXPECT_EQ(gpu.decide(bad), Status::kBadTolerance);
    ASSERT_EQ(gpu.decide(1e300), Status::kOk);
  }
  const auto expect = [&](const std::vector<ObjectPair>& given, Status status, std::uint64_t where) {
    AskedLevels gpu(scene, given);
    EXPECT_EQ(gpu.decide(0.1), status);
    EXPECT_EQ(gpu.report().where, where);
    EXPECT_EQ(gpu.report().counters, ToleranceCounters());
  };
  expect({{0, 1}, {1, 4}}, Status::kUnknownInstance, 1);
  scene.instances[2].asset = 2;
  expect(pairs, Status::kUnknownAsset, 2);
  scene.instances[2].asset = 0;
  scene.instances[3].pose.rotation[1][1] = 3;
  expect(pairs, Status::kPoseNotRigid, 3);
}

TEST_F(GpuTolerance, AViewsLevelsAloneAreUploaded) {
  const BodyScene scene = pile_of_levels(1, 1, 11);
  const AssetView all = scene.assets.views()[0];
  std::size_t last = GpuScene({&all, 1}, {}, {}).asset_bytes();
  EXPECT_EQ(last, all.header->file_bytes);
  for (std::uint32_t first = 1; first < all.levels.size(); ++first) {
    const AssetView view = all.levels_from(first);
    const GpuScene device({&view, 1}, {}, {}, Contents::all);
    std::size_t needed = 0;
    for (std::uint32_t i = 0; i < view.levels.size(); ++i) {
      const LevelView level = view.level(i);
      needed += level.triangle_count * (sizeof(Triangle) + sizeof(TriangleTopology)) +
                level.block_count * (sizeof(Block) + sizeof(OrientedBlock)) +
                level.component_count * sizeof(SurfaceComponent);
      if (level.source_vertices != nullptr) needed += level.vertex_count * sizeof(std::uint32_t);
    }
    EXPECT_GE(device.asset_bytes(), needed);
    EXPECT_LT(device.asset_bytes(), needed + 8 * view.levels.size() * kSectionAlignment);
    EXPECT_LT(device.asset_bytes(), last);
    last = device.asset_bytes();
    const LevelView copied = device.levels()[0].tree;
    EXPECT_EQ(download(copied.triangles, copied.triangle_count)[0].source_face(),
              all.level(first).triangles[0].source_face());
  }
}

}  // namespace
}  // namespace tandem
