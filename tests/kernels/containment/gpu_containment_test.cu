// Bodies within bodies on the GPU: the rows of the CPU, in the same order.
#include <gtest/gtest.h>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/containment/containment_scenes.h"
#include "tandem/kernels/gpu_containment_query.h"

namespace tandem {
namespace {

using test::GpuScene;
using test::PartedScene;
using test::RandomPoses;
using Rows = std::vector<Containment>;

GpuContactOptions grouped() {
  GpuContactOptions options = test::gpu_options(QueryMode::exact);
  options.grouped = true;
  return options;
}

Rows rows_of(const GpuContainmentQuery& query) {
  return test::download(query.contained(), query.report().contained);
}

Rows rows_of_cpu(const PartedScene& parted, const std::vector<ObjectPair>& pairs) {
  const test::BodyScene& scene = parted.scene;
  ContactQuery contacts;
  ContainmentQuery query;
  EXPECT_EQ(contacts.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(contacts.find_contacts(scene.instances, pairs, {}), Status::kOk);
  EXPECT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(query.find(scene.instances, pairs, contacts.contacts()), Status::kOk);
  return {query.contained().begin(), query.contained().end()};
}

std::size_t triangles_with_labels(const test::BodyScene& scene) {
  std::size_t count = 0;
  for (const AssetView& asset : scene.assets.views()) {
    if (asset.level().component_count != 1) count += asset.level().triangle_count;
  }
  return count;
}

/// A scene on the GPU, its contacts found and grouped.
struct Found {
  Found(const PartedScene& parted, const std::vector<ObjectPair>& given, Contents contents)
      : scene(parted.scene.assets, parted.scene.instances, given, contents) {
    EXPECT_EQ(contacts.set_assets(scene.assets(), nullptr), Status::kOk);
    EXPECT_EQ(contacts.find_contacts(scene.instances(), scene.pairs(), grouped(), nullptr), Status::kOk);
    EXPECT_EQ(query.set_assets(scene.assets(), nullptr), Status::kOk);
  }
  Status find() { return query.find(scene.instances(), scene.pairs(), contacts, nullptr); }
  Status enqueue(cudaStream_t stream) {
    return query.enqueue(scene.instances(), scene.pairs(), contacts, stream);
  }

  GpuScene scene;
  GpuContactQuery contacts;
  GpuContainmentQuery query;
};

class GpuContainments : public test::GpuTest {
 protected:
  /// Result: how many rows there are.
  std::size_t expect_those_of_the_cpu(const PartedScene& parted, const std::vector<ObjectPair>& pairs,
                                      Contents contents = Contents::all) {
    const Rows expected = rows_of_cpu(parted, pairs);
    Found found(parted, pairs, contents);
    EXPECT_EQ(found.find(), Status::kOk);
    EXPECT_EQ(rows_of(found.query), expected);
    EXPECT_LE(found.query.bytes(), most_containment_bytes(found.query.capacity(), parted.scene.assets.size(),
                                                          triangles_with_labels(parted.scene)));
    return expected.size();
  }
};

TEST_F(GpuContainments, AreThoseOfTheCpu) {
  std::size_t rows = 0;
  for (int i = 0; i < test::trials(40, 20); ++i) {
    SCOPED_TRACE(i);
    RandomPoses random(static_cast<std::uint64_t>(i));
    const double far = i % 5 == 4 ? std::pow(10.0, static_cast<double>(i % 9)) : 0;
    const PartedScene scene = test::nest(random, i % 2 == 0, far);
    rows += expect_those_of_the_cpu(scene, test::every_pair(scene.scene, true),
                                    i % 3 == 0 ? Contents::all : Contents::manifolds);
  }
  EXPECT_GT(rows, 100u);
}

TEST_F(GpuContainments, AreThoseOfTheCpuUnderTheDeepestTree) {
  RandomPoses random(3);
  const PartedScene scene = test::deep_nest(random);
  for (const Contents contents : {Contents::all, Contents::manifolds})
    EXPECT_GE(expect_those_of_the_cpu(scene, test::every_pair(scene.scene), contents), 3u);
}

TEST_F(GpuContainments, AreInOrderWhereThereAreManyPairs) {
  const PartedScene scene = test::crowded_nest(7, 96);
  const auto pairs = test::every_pair(scene.scene);
  EXPECT_GT(pairs.size(), 4096u);
  EXPECT_GT(expect_those_of_the_cpu(scene, pairs), 40u);
}

TEST_F(GpuContainments, WhatDoesNotFitIsToldAndNothingIsLostOnTheRetry) {
  const PartedScene scene = test::crowded_nest(7, 24);
  const auto pairs = test::every_pair(scene.scene);
  const auto count = static_cast<std::uint32_t>(pairs.size());
  const Rows expected = rows_of_cpu(scene, pairs);
  ASSERT_GT(expected.size(), 2u);
  const auto rows = static_cast<std::uint32_t>(expected.size());
  Found found(scene, pairs, Contents::all);
  const auto after = [&](const GpuContainmentCapacity& capacity) {
    EXPECT_EQ(found.query.reserve(capacity), Status::kOk);
    EXPECT_EQ(found.enqueue(nullptr), Status::kOk);
    EXPECT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
    return found.query.report();
  };
  EXPECT_EQ(after({0, rows}).complete, 0u);
  EXPECT_EQ(found.query.report().needed.pairs, count);
  EXPECT_EQ(found.query.report().contained, 0u);

  Found other(scene, pairs, Contents::all);
  EXPECT_EQ(other.query.reserve({count, rows - 1}), Status::kOk);
  EXPECT_EQ(other.enqueue(nullptr), Status::kOk);
  EXPECT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  EXPECT_EQ(other.query.report().complete, 0u);
  EXPECT_EQ(other.query.report().needed.contained, rows);
  EXPECT_EQ(other.query.report().contained, 0u);

  EXPECT_EQ(after({count, rows}).complete, 1u);
  EXPECT_EQ(rows_of(found.query), expected);
  EXPECT_EQ(other.find(), Status::kOk);
  EXPECT_EQ(rows_of(other.query), expected);
}

TEST_F(GpuContainments, AGraphFindsThemAgain) {
  const PartedScene scene = test::crowded_nest(5, 24);
  const auto pairs = test::every_pair(scene.scene);
  Found found(scene, pairs, Contents::manifolds);
  ASSERT_EQ(found.find(), Status::kOk);
  const Rows expected = rows_of(found.query);
  EXPECT_FALSE(expected.empty());
  GpuStream stream;
  ASSERT_EQ(stream.create(), cudaSuccess);
  GpuGraph graph;
  ASSERT_EQ(graph.capture(stream.get(), [&] { EXPECT_EQ(found.enqueue(stream.get()), Status::kOk); }),
            cudaSuccess);
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(cudaMemset(const_cast<Containment*>(found.query.contained()), 0xFF,
                         expected.size() * sizeof(Containment)),
              cudaSuccess);
    ASSERT_EQ(graph.launch(stream.get()), cudaSuccess);
    ASSERT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
    EXPECT_EQ(rows_of(found.query), expected);
  }
}

TEST_F(GpuContainments, OfAQueryThatFailedThereAreNone) {
  PartedScene scene = test::crowded_nest(5, 8);
  scene.scene.instances[3].pose.rotation[0][0] = 2;
  const auto pairs = test::every_pair(scene.scene);
  const GpuScene on_gpu(scene.scene.assets, scene.scene.instances, pairs);
  GpuContactQuery contacts;
  GpuContainmentQuery query;
  EXPECT_EQ(contacts.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  EXPECT_EQ(contacts.find_contacts(on_gpu.instances(), on_gpu.pairs(), grouped(), nullptr),
            Status::kPoseNotRigid);
  EXPECT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  EXPECT_EQ(query.find(on_gpu.instances(), on_gpu.pairs(), contacts, nullptr), Status::kPoseNotRigid);
  EXPECT_EQ(query.report().contained, 0u);
}

TEST_F(GpuContainments, NeedTopology) {
  const PartedScene scene = test::crowded_nest(5, 8);
  const GpuScene on_gpu(scene.scene.assets, scene.scene.instances, {}, Contents::exact_queries);
  GpuContainmentQuery query;
  EXPECT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kNoTopology);
}

}  // namespace
}  // namespace tandem
