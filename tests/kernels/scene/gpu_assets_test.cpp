// Tests what a query on a GPU needs of its assets: blocks of the kind that its mode walks, of any level and
// shape.
#include <gtest/gtest.h>

#include <vector>

#include "gpu/gpu_scene_fixture.h"
#include "gpu/made_files.h"
#include "kernels/contact/only_walk.h"

namespace tandem {
namespace {

using test::AskedContacts;
using test::BodyScene;
using test::Bytes;
using test::GpuScene;
using test::kModes;
using test::MadeLevel;
using test::RandomPoses;

class GpuAssets : public test::GpuTest {};

std::vector<Contact> contacts_on_gpu(std::span<const GpuAsset> assets, const GpuScene& scene,
                                     QueryMode mode) {
  GpuContactQuery query;
  EXPECT_EQ(query.set_assets(assets, nullptr), Status::kOk);
  EXPECT_EQ(query.find_contacts(scene.instances(), scene.pairs(), test::gpu_options(mode), nullptr),
            Status::kOk)
      << cudaGetErrorString(query.cuda_error());
  return test::sorted(test::download(query.contacts(), query.report().contacts));
}

/// Two bodies that meet.
std::vector<Instance> two_bodies(RandomPoses& random, double spread, std::uint32_t second_asset = 0) {
  const Pose first = random.pose({1, 1, spread, 0, 4});
  return {{0, first}, {second_asset, random.pose({1, 1, spread, 0, 4})}};
}

TEST_F(GpuAssets, OfExactQueriesAloneAnswerThemAndNoOthers) {
  RandomPoses random(1);
  const BodyScene scene = test::pile(30, 600, 1, 51);
  const auto pairs = test::all_pairs(scene.instances, true, random);
  AskedContacts gpu(scene, pairs, Contents::exact_queries);
  const auto expected = test::ask_cpu(scene, pairs).contacts;
  EXPECT_GT(expected.size(), 1000u);
  EXPECT_EQ(contacts_on_gpu(gpu.scene.assets(), gpu.scene, QueryMode::exact), expected);
  for (const QueryMode mode : {QueryMode::fast, QueryMode::boxes}) {
    EXPECT_EQ(gpu.find({mode}), Status::kNoAxisAlignedBlocks);
    EXPECT_EQ(gpu.enqueue(nullptr, GpuContactOptions{mode}), Status::kNoAxisAlignedBlocks);
  }
  ASSERT_EQ(gpu.find(), Status::kOk);
  EXPECT_EQ(gpu.report().contacts, expected.size());
}

TEST_F(GpuAssets, WithoutOrientedBlocksAnswerAllButExactQueries) {
  RandomPoses random(2);
  const MadeLevel levels[] = {test::built_level(test::soup(random, 900, 0.2))};
  const Bytes file = test::made_file(levels, false), other = test::made_file(levels);
  const AssetView views[] = {file.check().asset, other.check().asset};
  const std::vector<Instance> instances = two_bodies(random, 0.1, 1);
  const std::vector<ObjectPair> pairs = {{0, 1}, {0, 0}};
  DeviceAssets uploaded;
  ASSERT_EQ(uploaded.upload(views, Contents::all, nullptr), Status::kOk);
  const GpuAsset assets[] = {gpu_asset(uploaded.level(0), views[0]), gpu_asset(uploaded.level(1), views[1])};
  const GpuScene scene(std::span<const AssetView>(), instances, pairs);
  for (const QueryMode mode : {QueryMode::fast, QueryMode::boxes}) {
    const auto expected = test::ask_cpu(views, instances, pairs, {.mode = mode}).contacts;
    EXPECT_GT(expected.size(), 100u);
    EXPECT_EQ(contacts_on_gpu(assets, scene, mode), expected);
  }
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(assets, nullptr), Status::kOk);
  EXPECT_EQ(query.find_contacts(scene.instances(), scene.pairs(), {}, nullptr), Status::kNoOrientedBlocks);
  EXPECT_EQ(query.enqueue(scene.instances(), scene.pairs(), {}, nullptr), Status::kNoOrientedBlocks);
  only_walk(query, true);
  EXPECT_EQ(query.enqueue(scene.instances(), scene.pairs(), {}, nullptr), Status::kNoOrientedBlocks);
  // An upload for exact queries of such a file has triangles alone.
  ASSERT_EQ(uploaded.upload({views, 1}, Contents::exact_queries, nullptr), Status::kOk);
  EXPECT_EQ(uploaded.level(0).oriented_blocks, nullptr);
  EXPECT_EQ(uploaded.bytes(), 900 * sizeof(Triangle));
}

/// A query knows one level of an asset as it knows an asset.
TEST_F(GpuAssets, OfEveryLevelHaveThatLevelsContacts) {
  RandomPoses random(3);
  std::vector<MadeLevel> levels;
  std::vector<Bytes> alone;
  test::Mesh finest = test::soup(random, 2000, 0.2);
  finest.points[0] = {-2, -2, -2}, finest.points[1] = {2, 2, 2};  // all levels are within its bounds
  for (const std::uint32_t triangles : {2000u, 400u, 30u}) {
    levels.push_back(test::built_level(triangles == 2000 ? finest : test::soup(random, triangles, 0.3),
                                       2000.0 - triangles));
  }
  for (MadeLevel level : levels) {
    level.error_bound = 0;
    alone.push_back(test::made_file({&level, 1}));
  }
  const Bytes file = test::made_file(levels);
  ASSERT_EQ(file.check().status, Status::kOk);
  const AssetView view = file.check().asset;
  const std::vector<Instance> instances = two_bodies(random, 0.2);
  const std::vector<ObjectPair> pairs = {{0, 1}, {1, 1}};
  const GpuScene scene(std::span<const AssetView>(), instances, pairs);
  for (const Contents contents : {Contents::all, Contents::exact_queries}) {
    DeviceAssets uploaded;
    ASSERT_EQ(uploaded.upload({&view, 1}, contents, nullptr), Status::kOk);
    for (std::uint32_t i = 0; i < levels.size(); ++i) {
      const AssetView single = alone[i].check().asset;
      const GpuAsset level = gpu_asset(uploaded.level(0, i), view, i);
      for (const QueryMode mode : kModes) {
        if (contents == Contents::exact_queries && mode != QueryMode::exact) continue;
        const auto expected = test::ask_cpu({&single, 1}, instances, pairs, {.mode = mode}).contacts;
        EXPECT_FALSE(expected.empty());
        EXPECT_EQ(contacts_on_gpu({&level, 1}, scene, mode), expected) << "level " << i;
      }
    }
  }
}

TEST_F(GpuAssets, OfTheGreatestDepthAreWalked) {
  RandomPoses random(4);
  for (const std::uint32_t depth : {1u, 2u, 31u, kMaxDepth}) {
    const MadeLevel levels[] = {
        test::deep_level(test::soup(random, test::triangles_of_deep_level(depth), 1), depth)};
    const Bytes file = test::made_file(levels);
    ASSERT_EQ(file.check().status, Status::kOk);
    const AssetView view = file.check().asset;
    const std::vector<Instance> instances = two_bodies(random, 0.1);
    const std::vector<ObjectPair> pairs = {{0, 1}, {0, 0}};
    DeviceAssets uploaded;
    ASSERT_EQ(uploaded.upload({&view, 1}, Contents::all, nullptr), Status::kOk);
    const GpuAsset on_gpu = gpu_asset(uploaded.level(0), view);
    const GpuScene scene(std::span<const AssetView>(), instances, pairs);
    for (const QueryMode mode : kModes)
      EXPECT_EQ(contacts_on_gpu({&on_gpu, 1}, scene, mode),
                test::ask_cpu({&view, 1}, instances, pairs, {.mode = mode}).contacts)
          << "depth " << depth;
  }
}

TEST_F(GpuAssets, OfManyKindsAreWalkedTogether) {
  RandomPoses random(5);
  BodyScene scene;
  for (std::uint32_t i = 0; i < 300; ++i) {
    scene.assets.add(test::soup(random, 1 + i % 70, 0.3), {},
                     i % 3 == 0 ? build::Imaginary::free : build::Imaginary::minimal);
    scene.instances.push_back({i, random.pose({1, 1, 2, 0, 4})});
  }
  const auto pairs = test::all_pairs(scene.instances, false, random);
  for (const Contents contents : {Contents::all, Contents::exact_queries}) {
    const GpuScene on_gpu(scene.assets, scene.instances, pairs, contents);
    for (const QueryMode mode : kModes) {
      if (contents == Contents::exact_queries && mode != QueryMode::exact) continue;
      const auto expected = test::ask_cpu(scene, pairs, {.mode = mode}).contacts;
      EXPECT_GT(expected.size(), 1000u);
      EXPECT_EQ(contacts_on_gpu(on_gpu.assets(), on_gpu, mode), expected);
    }
  }
}

TEST_F(GpuAssets, OfMoreBlocksThanTheWalkCanNumberAreRefused) {
  const BodyScene scene = test::pile(2, 100, 1, 52);
  const GpuScene on_gpu(scene.assets, scene.instances, {});
  std::vector<GpuAsset> assets(on_gpu.assets().begin(), on_gpu.assets().end());
  GpuContactQuery query;
  assets[1].tree.block_count = (1u << 29) - 1;
  EXPECT_EQ(query.set_assets(assets, nullptr), Status::kOutOfRange);
  assets[1].tree.block_count = (1u << 29) - 2;
  EXPECT_EQ(query.set_assets(assets, nullptr), Status::kOk);
}

}  // namespace
}  // namespace tandem
