// Tests bodies that deform on a GPU: their trees have the bytes of the CPU's, and questions the answers of
// its scenes.
#include <gtest/gtest.h>

#include <cstring>

#include "bent_mesh.h"
#include "gpu/gpu_scene_fixture.h"
#include "gpu/made_files.h"
#include "kernels/geometry/relative_pose.h"
#include "kernels/refit/deformed_tree.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_containment_query.h"
#include "tandem/kernels/gpu_deformer.h"
#include "tandem/kernels/gpu_distance_query.h"
#include "tandem/kernels/gpu_impact_query.h"
#include "tandem/kernels/gpu_manifold_query.h"
#include "tandem/kernels/gpu_moved_query.h"
#include "tandem/kernels/gpu_probe_query.h"
#include "tandem/kernels/gpu_tolerance_query.h"

namespace tandem::test {
namespace {

using Files = std::vector<std::unique_ptr<Bytes>>;

std::vector<AssetView> views_of(const Files& files) {
  std::vector<AssetView> views;
  for (const auto& file : files) views.push_back(file->check().asset);
  return views;
}

/// The assets of some files on the GPU, of which some deform.
struct DeformingAssets {
  Files own;  // where it was given them to keep
  std::vector<AssetView> views;
  DeviceAssets uploaded;
  std::vector<GpuAsset> assets;
  GpuAssetList list;
  std::vector<std::uint32_t> bodies;
  GpuDeformer deformer;
  std::vector<GpuArray<float>> in_float32;  // of each body
  std::vector<GpuArray<double>> in_float64;
  GpuArray<const float*> places;
  GpuArray<const double*> places_in_float64;

  DeformingAssets(const Files& files, std::vector<std::uint32_t> deforming, Contents contents = Contents::all,
                  PositionTypes types = PositionTypes::float32)
      : views(views_of(files)),
        bodies(std::move(deforming)),
        in_float32(bodies.size()),
        in_float64(bodies.size()) {
    EXPECT_EQ(uploaded.upload(views, contents, nullptr), Status::kOk);
    for (std::size_t i = 0; i < views.size(); ++i) assets.push_back(gpu_asset(uploaded.level(i), views[i]));
    EXPECT_EQ(list.set(assets, types, nullptr), Status::kOk);
    EXPECT_EQ(deformer.begin(assets, bodies, list.records(), nullptr), Status::kOk)
        << cudaGetErrorString(deformer.cuda_error());
  }

  DeformingAssets(Files&& files, std::vector<std::uint32_t> deforming, Contents contents = Contents::all,
                  PositionTypes types = PositionTypes::float32)
      : DeformingAssets(files, std::move(deforming), contents, types) {
    own = std::move(files);
  }

  /// An empty list: the body stays as it is.
  void upload(const std::vector<std::vector<float>>& now) { upload(now, in_float32, places); }

  Status deform(const std::vector<std::vector<float>>& now) {
    upload(now);
    return deformer.deform({.in_float32 = places.data()}, nullptr);
  }
  Status deform(const std::vector<std::vector<double>>& now) {
    upload(now, in_float64, places_in_float64);
    return deformer.deform({.in_float64 = places_in_float64.data()}, nullptr);
  }
  Status deform(const std::vector<std::vector<float>>& single,
                const std::vector<std::vector<double>>& precise) {
    upload(single);
    upload(precise, in_float64, places_in_float64);
    return deformer.deform({places.data(), places_in_float64.data()}, nullptr);
  }

 private:
  template <typename Real>
  void upload(const std::vector<std::vector<Real>>& now, std::vector<GpuArray<Real>>& arrays,
              GpuArray<const Real*>& to) {
    std::vector<const Real*> place;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      EXPECT_EQ(arrays[i].upload(now[i], nullptr), cudaSuccess);
      place.push_back(now[i].empty() ? nullptr : arrays[i].data());
    }
    EXPECT_EQ(to.upload(place, nullptr), cudaSuccess);
    EXPECT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  }
};

template <typename Element>
void expect_same_elements(const Element* on_gpu, const Element* wanted, std::size_t count, const char* what) {
  const std::vector<Element> found = download(on_gpu, count);
  for (std::size_t i = 0; i < count; ++i)
    ASSERT_EQ(std::memcmp(&found[i], &wanted[i], sizeof(Element)), 0) << what << " " << i << " of " << count;
}

/// The oriented blocks of a deformed tree.
std::vector<OrientedBlock> deformed_oriented(const LevelView& rest, const LevelView& deformed) {
  std::vector<OrientedBlock> out(rest.oriented_blocks, rest.oriented_blocks + rest.block_count);
  const std::vector<std::uint32_t> block_of = blocks_of_oriented(rest);
  for (std::uint32_t i = 0; i < rest.block_count; ++i) {
    const Block& block = deformed.blocks[block_of[i]];
    std::memcpy(out[i].centre, block.centre, sizeof block.centre);
    std::memcpy(out[i].half_extent, block.half_extent, sizeof block.half_extent);
    out[i].rotation = kNoRotation;
    out[i].size = oriented_size(out[i]);
  }
  return out;
}

/// What lies on the GPU is what the CPU makes of the same positions.
template <typename Real>
void expect_same_tree(const DeformingAssets& of, std::uint32_t body, const std::vector<Real>& now) {
  const std::uint32_t number = of.bodies[body];
  const LevelView rest = of.views[number].level(), level = of.deformer.level(body);
  DeformedTree tree;
  ASSERT_EQ(tree.begin(rest), Status::kOk);
  ASSERT_EQ(tree.refit(std::span<const Real>(now)), Status::kOk);
  expect_same_elements(level.triangles, tree.level().triangles, rest.triangle_count, "triangle");
  if (level.blocks != nullptr)
    expect_same_elements(level.blocks, tree.level().blocks, rest.block_count, "block");
  if (level.oriented_blocks != nullptr)
    expect_same_elements(level.oriented_blocks, deformed_oriented(rest, tree.level()).data(),
                         rest.block_count, "oriented block");
  const GpuAsset record = download(of.list.records().assets + number, 1)[0];
  const AssetBounds bounds = download(of.list.records().bounds + number, 1)[0];
  TreeExtent extent = extent_of(tree.level().blocks[0]);
  widen_for_rounding(tree.rounding(), extent);
  float lower[3], upper[3];
  ASSERT_EQ(check_positions(std::span<const Real>(now), lower, upper), now.size() / 3);
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(record.lower[k] == lower[k] && record.upper[k] == upper[k]);
    EXPECT_TRUE(bounds.lower[k] == lower[k] && bounds.upper[k] == upper[k]);
    EXPECT_TRUE(record.origin[k] == 0 && bounds.origin[k] == 0);
    EXPECT_TRUE(record.extent.reach[k] == extent.reach[k] &&
                record.extent.half_extent[k] == extent.half_extent[k] &&
                record.extent.posed_reach[k] == extent.posed_reach[k]);
  }
  EXPECT_EQ(record.tree.triangles, level.triangles);
  EXPECT_EQ(record.tree.blocks, level.blocks);
  EXPECT_EQ(record.tree.oriented_blocks, level.oriented_blocks);
  EXPECT_EQ(record.tree.topology, of.assets[number].tree.topology);
  ASSERT_EQ(record.tree.precise, tree.level().precise != nullptr ? level.precise : nullptr);
  if (record.tree.precise != nullptr)
    expect_same_elements(level.precise, tree.level().precise, rest.triangle_count,
                         "float64 corners of triangle");
}

Files refittable(const std::vector<Mesh>& meshes) {
  Files files;
  for (const Mesh& mesh : meshes) files.push_back(std::make_unique<Bytes>(make_refittable_file(mesh)));
  return files;
}

std::vector<Mesh> small_and_large_meshes() {
  std::vector<Mesh> meshes;
  for (const std::uint32_t count : {1u, 2u, 5u, 17u, 400u, 3000u})
    meshes.push_back(random_mesh(count, count));
  meshes.push_back(cube(0.5f, 60));
  for (Mesh& mesh : meshes) mesh = welded(mesh);
  meshes.push_back(meshes.front());
  return meshes;
}

using GpuDeformerTest = GpuTest;

TEST_F(GpuDeformerTest, WritesTheBytesOfTheCpu) {
  const std::vector<Mesh> meshes = small_and_large_meshes();
  Files files = refittable(meshes);
  DeformingAssets of(files, {0, 1, 3, 4, 5, 6, 7});
  RandomPoses random(21);
  std::vector<std::vector<float>> shape(of.bodies.size());
  for (int step = 0; step < trials(12, 20); ++step) {
    std::vector<std::vector<float>> now(of.bodies.size());
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (step > 0 && random.below(4) == 0) continue;
      const Bend bend = kBends[random.below(std::size(kBends))];
      now[i] = single(bent(bend, random.symmetric(4), positions_of(meshes[of.bodies[i]]), random));
      shape[i] = now[i];
    }
    ASSERT_EQ(of.deform(now), Status::kOk) << cudaGetErrorString(of.deformer.cuda_error());
    for (std::uint32_t i = 0; i < shape.size(); ++i) {
      SCOPED_TRACE(testing::Message() << "step " << step << ", body " << i);
      expect_same_tree(of, i, shape[i]);
    }
  }
}

// Coordinates of any bits, so that boxes are rounded in every way there is.
TEST_F(GpuDeformerTest, WritesTheBytesOfTheCpuForAnyFiniteCoordinates) {
  const Mesh mesh = random_mesh(500, 4);
  DeformingAssets of(refittable({mesh}), {0});
  RandomPoses random(22);
  std::vector<float> now(3 * mesh.points.size());
  for (int step = 0; step < trials(30, 30); ++step) {
    for (float& x : now) {
      do {
        const auto bits = static_cast<std::uint32_t>(random.engine()());
        std::memcpy(&x, &bits, sizeof x);
        if (step % 3 == 0)
          x = std::ldexp(1 + static_cast<float>(bits % 8) * 0x1p-23f, static_cast<int>(bits >> 8) % 26);
      } while (!(std::fabs(x) <= kMaxCoordinate));
    }
    ASSERT_EQ(of.deform({now}), Status::kOk);
    expect_same_tree(of, 0, now);
  }
}

// Bodies change between float32, float64 and numbers that fit both.
TEST_F(GpuDeformerTest, WritesTheBytesOfTheCpuForPositionsInFloat64) {
  const std::vector<Mesh> meshes = small_and_large_meshes();
  DeformingAssets of(refittable(meshes), {0, 1, 3, 4, 5, 6, 7}, Contents::all,
                     PositionTypes::float32_and_float64);
  RandomPoses random(26);
  const std::size_t count = of.bodies.size();
  std::vector<std::vector<float>> last_single(count);
  std::vector<std::vector<double>> last_precise(count);
  for (int step = 0; step < trials(12, 20); ++step) {
    std::vector<std::vector<float>> single_now(count);
    std::vector<std::vector<double>> precise_now(count);
    for (std::size_t i = 0; i < count; ++i) {
      const Bend bend = kBends[random.below(std::size(kBends))];
      const Positions now = bent(bend, random.symmetric(4), positions_of(meshes[of.bodies[i]]), random);
      const std::vector<float> rounded = single(now);
      switch (random.below(step > 0 ? 4 : 3)) {
        case 0:
          last_single[i] = single_now[i] = rounded, last_precise[i].clear();
          break;
        case 1:
          last_precise[i] = precise_now[i] = flat(now), last_single[i].clear();
          break;
        case 2:
          precise_now[i].assign(rounded.begin(), rounded.end());
          last_precise[i] = precise_now[i], last_single[i].clear();
          break;
        default:
          break;
      }
    }
    ASSERT_EQ(of.deform(single_now, precise_now), Status::kOk)
        << cudaGetErrorString(of.deformer.cuda_error());
    for (std::uint32_t i = 0; i < count; ++i) {
      SCOPED_TRACE(testing::Message() << "step " << step << ", body " << i);
      if (last_precise[i].empty())
        expect_same_tree(of, i, last_single[i]);
      else
        expect_same_tree(of, i, last_precise[i]);
    }
  }
}

// Coordinates of any bits that are in range, so that they are rounded in every way there is.
TEST_F(GpuDeformerTest, WritesTheBytesOfTheCpuForAnyFloat64Coordinates) {
  const Mesh mesh = random_mesh(500, 4);
  DeformingAssets of(refittable({mesh}), {0}, Contents::all, PositionTypes::float32_and_float64);
  RandomPoses random(27);
  std::vector<double> now(3 * mesh.points.size());
  for (int step = 0; step < trials(30, 30); ++step) {
    for (double& x : now) {
      do {
        const std::uint64_t bits = random.engine()();
        std::memcpy(&x, &bits, sizeof x);
        if (step % 3 == 0)
          x = std::ldexp(1 + static_cast<double>(bits % 8) * 0x1p-26, static_cast<int>(bits >> 8 & 31));
        if (step % 3 == 1)  // near the smallest numbers of float32
          x = std::ldexp(static_cast<double>(bits % 1000) - 500, -150 - static_cast<int>(bits >> 20 & 7));
      } while (!(std::fabs(x) <= static_cast<double>(kMaxCoordinate)));
    }
    ASSERT_EQ(of.deform(std::vector<std::vector<double>>{now}), Status::kOk);
    expect_same_tree(of, 0, now);
  }
}

TEST_F(GpuDeformerTest, TakesTreesWithBlocksOfOneKind) {
  const Mesh mesh = welded(cube(0.5f, 12));
  const MadeLevel level = built_level(mesh);
  Files files = refittable({mesh});
  files.push_back(std::make_unique<Bytes>(made_file({&level, 1}, false)));
  RandomPoses random(23);
  const std::vector<float> now = single(bent(Bend::wave, 1, positions_of(mesh), random));
  DeformingAssets without_oriented(files, {1}), without_others(files, {0}, Contents::manifolds);
  EXPECT_EQ(without_oriented.deformer.level(0).oriented_blocks, nullptr);
  EXPECT_EQ(without_others.deformer.level(0).blocks, nullptr);
  ASSERT_EQ(without_oriented.deform({now}), Status::kOk);
  ASSERT_EQ(without_others.deform({now}), Status::kOk);
  expect_same_tree(without_oriented, 0, now);
  expect_same_tree(without_others, 0, now);
}

TEST_F(GpuDeformerTest, BodiesWithBadPositionsStayAsTheyAreAndTheFirstIsNamed) {
  const Mesh mesh = welded(cube(0.5f, 24));  // more vertices than a thread block checks
  const Files files = refittable({mesh, mesh, mesh, mesh});
  DeformingAssets of(files, {0, 1, 2, 3});
  RandomPoses random(24);
  const std::vector<float> first = single(bent(Bend::twist, 1, positions_of(mesh), random)),
                           second = single(bent(Bend::wave, 1, positions_of(mesh), random));
  ASSERT_GT(mesh.points.size(), 2500u);
  ASSERT_EQ(of.deform({first, first, first, first}), Status::kOk);
  std::vector<std::vector<float>> bad(4, second);
  bad[1][3 * 2400 + 1] = NAN;
  bad[1][3 * 2450] = INFINITY;
  bad[3][2] = std::nextafter(kMaxCoordinate, INFINITY);
  EXPECT_EQ(of.deform(bad), Status::kOutOfRange);
  EXPECT_EQ(of.deformer.report().body, 1u);
  EXPECT_EQ(of.deformer.report().where, 2400u);
  const GpuDeformReport on_gpu = download(of.deformer.device_report(), 1)[0];
  EXPECT_TRUE(on_gpu.status == Status::kOutOfRange && on_gpu.body == 1 && on_gpu.where == 2400);
  for (const std::uint32_t body : {0u, 2u}) expect_same_tree(of, body, second);
  for (const std::uint32_t body : {1u, 3u}) expect_same_tree(of, body, first);
  bad[1] = {};
  EXPECT_EQ(of.deform(bad), Status::kOutOfRange);
  EXPECT_EQ(of.deformer.report().body, 3u);
  EXPECT_EQ(of.deformer.report().where, 0u);
  bad[3] = second;
  bad[3][0] = -kMaxCoordinate;
  EXPECT_EQ(of.deform(bad), Status::kOk);
  expect_same_tree(of, 3, bad[3]);
}

TEST_F(GpuDeformerTest, BadPositionsInFloat64AreNamedBesideOthers) {
  const Mesh mesh = welded(cube(0.5f, 24));
  DeformingAssets of(refittable({mesh, mesh, mesh}), {0, 1, 2}, Contents::all,
                     PositionTypes::float32_and_float64);
  RandomPoses random(28);
  const Positions twisted = bent(Bend::twist, 1, positions_of(mesh), random),
                  waving = bent(Bend::wave, 1, positions_of(mesh), random);
  ASSERT_EQ(of.deform({single(twisted), single(twisted), {}}, {{}, {}, flat(twisted)}), Status::kOk);
  std::vector<double> bad = flat(waving);
  bad[3 * 2400 + 2] = std::nextafter(static_cast<double>(kMaxCoordinate), INFINITY);
  bad[3 * 2401] = NAN;
  EXPECT_EQ(of.deform({single(waving), {}, {}}, {{}, flat(waving), bad}), Status::kOutOfRange);
  EXPECT_EQ(of.deformer.report().body, 2u);
  EXPECT_EQ(of.deformer.report().where, 2400u);
  expect_same_tree(of, 0, single(waving));
  expect_same_tree(of, 1, flat(waving));
  expect_same_tree(of, 2, flat(twisted));
}

TEST_F(GpuDeformerTest, WhatCannotDeformIsNamed) {
  const Mesh mesh = cube(0.5f, 1);
  Files files = refittable({mesh});
  files.push_back(std::make_unique<Bytes>(make_file(mesh)));
  const std::vector<AssetView> views = views_of(files);
  DeviceAssets uploaded, without;
  ASSERT_EQ(uploaded.upload(views, Contents::all, nullptr), Status::kOk);
  ASSERT_EQ(without.upload(views, Contents::exact_queries, nullptr), Status::kOk);
  const GpuAsset assets[] = {gpu_asset(uploaded.level(0), views[0]), gpu_asset(uploaded.level(1), views[1])};
  const GpuAsset few[] = {gpu_asset(without.level(0), views[0])};
  GpuAssetList list;
  ASSERT_EQ(list.set(assets, PositionTypes::float32, nullptr), Status::kOk);
  GpuDeformer deformer;
  const auto begin = [&](std::span<const GpuAsset> of, std::uint32_t body) {
    return deformer.begin(of, std::span(&body, 1), list.records(), nullptr);
  };
  EXPECT_EQ(begin(assets, 2), Status::kUnknownAsset);
  EXPECT_EQ(begin(assets, 1), Status::kNoSourceVertices);
  EXPECT_EQ(begin(few, 0), Status::kNoSourceVertices);
  EXPECT_EQ(deformer.bodies(), 0u);
  EXPECT_EQ(deformer.deform({}, nullptr), Status::kOk);
  EXPECT_EQ(begin(assets, 0), Status::kOk);
  EXPECT_EQ(deformer.bodies(), 1u);
  GpuToleranceQuery verdicts;
  GpuMovedQuery moved;
  ASSERT_EQ(verdicts.set_assets(std::span(assets).first(1), nullptr), Status::kOk);
  ASSERT_EQ(moved.set_assets(std::span(assets).first(1), nullptr), Status::kOk);
  EXPECT_EQ(verdicts.follow(list.records()), Status::kDeformed);
  EXPECT_EQ(moved.follow(list.records()), Status::kDeformed);
  EXPECT_EQ(moved.follow({}), Status::kOk);
}

TEST_F(GpuDeformerTest, QuestionsThatTakeNoFloat64SayWhichAssetsMayHaveIt) {
  const Files files = refittable({cube(0.5f, 1)});
  DeformingAssets single(files, {0}), precise(files, {0}, Contents::all, PositionTypes::float32_and_float64);
  const auto follow = [&](auto query, const DeformingAssets& of) {
    EXPECT_EQ(query.set_assets(of.assets, nullptr), Status::kOk);
    return query.follow(of.list.records());
  };
  for (const DeformingAssets* of : {&single, &precise}) {
    const Status refused = of == &single ? Status::kOk : Status::kNotFloat32;
    EXPECT_EQ(follow(GpuManifoldQuery(), *of), refused);
    EXPECT_EQ(follow(GpuContainmentQuery(), *of), refused);
    EXPECT_EQ(follow(GpuImpactQuery(), *of), refused);
    EXPECT_EQ(follow(GpuContactQuery(), *of), Status::kOk);
    EXPECT_EQ(follow(GpuDistanceQuery(), *of), Status::kOk);
    EXPECT_EQ(follow(GpuProbeQuery(), *of), Status::kOk);
  }
  const std::vector<double> now(3 * single.assets[0].source_vertices, 1.0 / 3);
  const std::vector<std::vector<double>> of_all = {now};
  EXPECT_EQ(single.deform(of_all), Status::kNotFloat32);
  EXPECT_EQ(precise.deform(of_all), Status::kOk);
}

/// Bodies near each other, each an asset of its own.
struct Crowd {
  std::vector<Mesh> meshes;
  Files files;
  std::vector<Instance> instances;

  explicit Crowd(RandomPoses& random) {
    for (const Mesh& mesh : {sheet(2, 6), cube(0.75f, 4), random_mesh(60, 7), sphere(0.8, 3), cube(0.6f, 3)})
      meshes.push_back(welded(mesh));
    files = refittable(meshes);
    for (std::uint32_t asset = 0; asset < meshes.size(); ++asset) {
      Pose pose = any_rotation(random);
      for (double& t : pose.translation) t = random.symmetric(0.8);
      instances.push_back({asset, pose});
    }
  }

  std::vector<float> bent_body(std::uint32_t body, RandomPoses& random,
                               std::size_t ways = std::size(kBends)) const {
    return single(bent(kBends[random.below(ways)], random.symmetric(2), positions_of(meshes[body]), random));
  }
};

/// Refit, broad phase and contacts in one graph, whose launches find what the CPU finds at the positions of
/// the time.
TEST_F(GpuDeformerTest, AGraphIsReplayedWithNewPositionsInPlace) {
  RandomPoses random(25);
  const Crowd crowd(random);
  const std::vector<std::uint32_t> deforming = {0, 1, 2, 3};
  DeformingAssets of(crowd.files, deforming);
  const std::vector<Instance>& instances = crowd.instances;
  std::vector<std::uint32_t> numbers;
  std::vector<Pose> poses;
  for (const Instance& instance : instances)
    numbers.push_back(instance.asset), poses.push_back(instance.pose);
  const GpuArray<std::uint32_t> asset = on_gpu(numbers);
  const GpuArray<Pose> pose = on_gpu(poses);
  const GpuInstances placed = {asset.data(), pose.data(), static_cast<std::uint32_t>(instances.size())};
  Scene scene;
  ASSERT_EQ(scene.set_assets(of.views), Status::kOk);
  ASSERT_EQ(scene.place(instances), Status::kOk);
  std::vector<std::vector<float>> now;
  for (const std::uint32_t body : deforming) now.push_back(single(positions_of(crowd.meshes[body])));
  of.upload(now);

  GpuBroadPhase broad_phase;
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(of.assets, nullptr), Status::kOk);
  ASSERT_EQ(query.follow(of.list.records()), Status::kOk);
  const GpuBroadPhaseOptions sorted_pairs = {.sorted = true};
  ASSERT_EQ(broad_phase.reserve({placed.count, 100, placed.count}, sorted_pairs), Status::kOk);
  ASSERT_EQ(query.reserve({100, 100000, 100000}), Status::kOk);
  GraphStream graph;
  graph.capture([&] {
    Status status = of.deformer.enqueue({.in_float32 = of.places.data()}, graph.get());
    if (status == Status::kOk)
      status = broad_phase.enqueue(placed, of.list.records().bounds_of_all(), sorted_pairs, graph.get());
    return status == Status::kOk
               ? query.enqueue(placed, broad_phase.pairs(), gpu_options(QueryMode::exact), graph.get())
               : status;
  });
  std::size_t contacts = 0;
  for (int step = 0; step < trials(20, 10); ++step) {
    for (std::uint32_t i = 0; i < deforming.size(); ++i) {
      now[i] = crowd.bent_body(deforming[i], random);
      ASSERT_EQ(scene.deform(deforming[i], now[i]), Status::kOk);
    }
    of.upload(now);
    graph.launch();
    ASSERT_EQ(of.deformer.report().status, Status::kOk);
    ASSERT_EQ(broad_phase.report().status, Status::kOk);
    ASSERT_EQ(query.report().status, Status::kOk);
    ASSERT_NE(query.report().complete, 0u);
    ContactQuery on_cpu;
    ASSERT_EQ(on_cpu.find(scene), Status::kOk);
    ASSERT_EQ(broad_phase.report().found, on_cpu.pairs().size());
    EXPECT_EQ(sorted(download(query.contacts(), query.report().contacts)),
              sorted({on_cpu.rows().begin(), on_cpu.rows().end()}))
        << step;
    contacts += query.report().contacts;
  }
  EXPECT_GT(contacts, 1000u);
}

}  // namespace
}  // namespace tandem::test
