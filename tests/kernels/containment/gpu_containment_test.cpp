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

Rows rows_of_cpu(const PartedScene& parted, const std::vector<ObjectPair>& pairs) {
  const test::BodyScene& scene = parted.scene;
  Scene bodies;
  ContainmentQuery query;
  EXPECT_EQ(bodies.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(bodies.place(scene.instances), Status::kOk);
  EXPECT_EQ(query.find(bodies, pairs, test::ask_cpu(scene, pairs).contacts), Status::kOk);
  return {query.rows().begin(), query.rows().end()};
}

std::size_t triangles_with_labels(const test::BodyScene& scene) {
  std::size_t count = 0;
  for (const AssetView& asset : scene.assets.views()) {
    if (asset.level().component_count != 1) count += asset.level().triangle_count;
  }
  return count;
}

/// A scene on the GPU, its contacts found and grouped.
struct Found : test::AskedContacts {
  Found(const PartedScene& parted, const std::vector<ObjectPair>& given, Contents contents = Contents::all,
        Status status = Status::kOk)
      : AskedContacts(parted.scene, given, contents) {
    EXPECT_EQ(AskedContacts::find(test::grouped_options()), status);
    EXPECT_EQ(contained.set_assets(scene.assets(), nullptr), Status::kOk);
  }
  Status find() { return contained.find(scene.instances(), scene.pairs(), query, nullptr); }
  Status enqueue(cudaStream_t stream) {
    return contained.enqueue(scene.instances(), scene.pairs(), query, stream);
  }
  GpuContainmentReport after(const GpuContainmentCapacity& capacity) {
    EXPECT_EQ(contained.reserve(capacity), Status::kOk);
    EXPECT_EQ(enqueue(nullptr), Status::kOk);
    EXPECT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
    return contained.report();
  }
  Rows rows() const { return test::download(contained.contained(), contained.report().contained); }

  GpuContainmentQuery contained;
};

class GpuContainments : public test::GpuTest {
 protected:
  /// Result: how many rows there are.
  std::size_t expect_those_of_the_cpu(const PartedScene& parted, const std::vector<ObjectPair>& pairs,
                                      Contents contents = Contents::all) {
    const Rows expected = rows_of_cpu(parted, pairs);
    Found found(parted, pairs, contents);
    EXPECT_EQ(found.find(), Status::kOk);
    EXPECT_EQ(found.rows(), expected);
    EXPECT_LE(found.contained.bytes(),
              most_containment_bytes(found.contained.capacity(), parted.scene.assets.size(),
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
  Found found(scene, pairs);
  const GpuContainmentReport without_pairs = found.after({0, rows});
  EXPECT_EQ(without_pairs.complete, 0u);
  EXPECT_EQ(without_pairs.needed.pairs, count);
  EXPECT_EQ(without_pairs.contained, 0u);

  Found other(scene, pairs);
  const GpuContainmentReport without_a_row = other.after({count, rows - 1});
  EXPECT_EQ(without_a_row.complete, 0u);
  EXPECT_EQ(without_a_row.needed.contained, rows);
  EXPECT_EQ(without_a_row.contained, 0u);

  EXPECT_EQ(found.after({count, rows}).complete, 1u);
  EXPECT_EQ(found.rows(), expected);
  EXPECT_EQ(other.find(), Status::kOk);
  EXPECT_EQ(other.rows(), expected);
}

TEST_F(GpuContainments, AGraphFindsThemAgain) {
  const PartedScene scene = test::crowded_nest(5, 24);
  const auto pairs = test::every_pair(scene.scene);
  Found found(scene, pairs, Contents::manifolds);
  ASSERT_EQ(found.find(), Status::kOk);
  const Rows expected = found.rows();
  EXPECT_FALSE(expected.empty());
  test::GraphStream stream;
  stream.capture([&] { return found.enqueue(stream.get()); });
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(cudaMemset(const_cast<Containment*>(found.contained.contained()), 0xFF,
                         expected.size() * sizeof(Containment)),
              cudaSuccess);
    stream.launch();
    EXPECT_EQ(found.rows(), expected);
  }
}

TEST_F(GpuContainments, OfAQueryThatFailedThereAreNone) {
  PartedScene scene = test::crowded_nest(5, 8);
  scene.scene.instances[3].pose.rotation[0][0] = 2;
  Found found(scene, test::every_pair(scene.scene), Contents::all, Status::kPoseNotRigid);
  EXPECT_EQ(found.find(), Status::kPoseNotRigid);
  EXPECT_EQ(found.contained.report().contained, 0u);
}

TEST_F(GpuContainments, NeedTopology) {
  test::expect_needed<GpuContainmentQuery>(test::crowded_nest(5, 8).scene, Contents::exact_queries,
                                           Status::kNoTopology);
}

}  // namespace
}  // namespace tandem
