// Contacts sorted on the GPU: byte by byte those of the CPU, sorted there.
#include <gtest/gtest.h>

#include <tuple>

#include "gpu/gpu_scene_fixture.h"

namespace tandem {
namespace {

using test::BodyScene;
using test::download;
using test::GpuScene;

auto key(const Contact& c) {
  return std::tie(c.pair, c.face_a, c.face_b, c.triangle_a, c.triangle_b);
}

std::vector<Contact> expected_of(const BodyScene& scene, const std::vector<ObjectPair>& pairs,
                                 QueryMode mode) {
  ContactQuery query;
  EXPECT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(query.find_contacts(scene.instances, pairs, {.mode = mode}), Status::kOk);
  std::vector<Contact> contacts(query.contacts().begin(), query.contacts().end());
  for (Contact& c : contacts) {
    if (pairs[c.pair].a != pairs[c.pair].b || c.face_a <= c.face_b) continue;
    std::swap(c.face_a, c.face_b);
    std::swap(c.triangle_a, c.triangle_b);
  }
  std::sort(contacts.begin(), contacts.end(),
            [](const Contact& x, const Contact& y) { return key(x) < key(y); });
  return contacts;
}

/// As if several triangles were cut of one face, as in a mesh of polygons.
void share_faces(const BodyScene& scene) {
  for (const AssetView& view : scene.assets.views()) {
    const LevelView level = view.level();
    auto* triangles = const_cast<Triangle*>(level.triangles);
    for (std::uint32_t i = 0; i < level.triangle_count; ++i) triangles[i].corner[0].w /= 5;
  }
}

GpuContactOptions sorted(QueryMode mode) {
  GpuContactOptions options = test::gpu_options(mode);
  options.sorted = true;
  return options;
}

class GpuSorted : public test::GpuTest {};

TEST_F(GpuSorted, ContactsAreTheCpusSorted) {
  BodyScene scene = test::pile(60, 800, 2, 21);
  share_faces(scene);
  std::vector<ObjectPair> pairs;
  for (std::uint32_t a = 0; a < 60; ++a) {
    for (std::uint32_t b = a; b < 60; ++b)
      pairs.push_back((a + b) % 2 == 0 ? ObjectPair{a, b} : ObjectPair{b, a});
  }
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  for (const QueryMode mode : {QueryMode::exact, QueryMode::fast, QueryMode::boxes}) {
    const std::vector<Contact> expected = expected_of(scene, pairs, mode);
    EXPECT_GT(expected.size(), 10000u);
    for (int run = 0; run < 3; ++run) {  // first with too little room, then with enough, then with too much
      ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), sorted(mode), nullptr), Status::kOk);
      EXPECT_EQ(download(query.contacts(), query.report().contacts), expected);
    }
  }
}

TEST_F(GpuSorted, AGraphSortsAgainAndAnUnsortedQueryIsStillOne) {
  const BodyScene scene = test::pile(20, 500, 1, 22);
  const std::vector<ObjectPair> pairs = {{0, 1}, {7, 2}, {3, 3}, {4, 19}, {5, 6}};
  const std::vector<Contact> expected = expected_of(scene, pairs, QueryMode::exact);
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  GpuContactQuery query;
  GpuStream owner;
  ASSERT_EQ(owner.create(), cudaSuccess);
  const cudaStream_t stream = owner.get();
  ASSERT_EQ(query.set_assets(on_gpu.assets(), stream), Status::kOk);
  const GpuContactOptions options = sorted(QueryMode::exact);
  ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), options, stream), Status::kOk);
  GpuGraph graph;
  const auto enqueue = [&] {
    EXPECT_EQ(query.enqueue(on_gpu.instances(), on_gpu.pairs(), options, stream), Status::kOk);
  };
  ASSERT_EQ(graph.capture(stream, enqueue), cudaSuccess);
  for (int run = 0; run < 3; ++run) {
    ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), {}, stream), Status::kOk);
    EXPECT_EQ(query.report().contacts, expected.size());
    ASSERT_EQ(graph.launch(stream), cudaSuccess);
    ASSERT_EQ(cudaStreamSynchronize(stream), cudaSuccess);
    EXPECT_EQ(download(query.contacts(), query.report().contacts), expected);
  }
}

TEST_F(GpuSorted, WhatDoesNotFitOrFailsIsToldAsEver) {
  BodyScene scene = test::pile(10, 500, 1, 23);
  const std::vector<ObjectPair> pairs = {{0, 1}, {2, 3}, {4, 5}, {6, 7}};
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  ASSERT_EQ(query.reserve({4, 50, 100}), Status::kOk);
  EXPECT_EQ(query.enqueue(on_gpu.instances(), on_gpu.pairs(), sorted(QueryMode::exact), nullptr),
            Status::kOutOfRange);
  ASSERT_EQ(query.reserve({4, 50, 100}, sorted(QueryMode::exact)), Status::kOk);
  ASSERT_EQ(query.enqueue(on_gpu.instances(), on_gpu.pairs(), sorted(QueryMode::exact), nullptr),
            Status::kOk);
  ASSERT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  EXPECT_EQ(query.report().complete, 0u);
  EXPECT_EQ(query.report().contacts, 50u);
  const auto some = download(query.contacts(), 50);
  EXPECT_TRUE(std::is_sorted(some.begin(), some.end(),
                             [](const Contact& x, const Contact& y) { return key(x) < key(y); }));
  scene.instances[3].pose.rotation[0][0] += 1;
  const GpuScene wrong(scene.assets, scene.instances, pairs);
  EXPECT_EQ(query.find_contacts(wrong.instances(), wrong.pairs(), sorted(QueryMode::exact), nullptr),
            Status::kPoseNotRigid);
  EXPECT_EQ(query.report().contacts, 0u);
}

}  // namespace
}  // namespace tandem
