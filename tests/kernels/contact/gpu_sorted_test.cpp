// Contacts sorted on the GPU: byte by byte those of the CPU, sorted there.
#include <gtest/gtest.h>

#include "gpu/gpu_scene_fixture.h"

namespace tandem {
namespace {

using test::AskedContacts;
using test::BodyScene;

std::vector<Contact> expected_of(const BodyScene& scene, const std::vector<ObjectPair>& pairs,
                                 QueryMode mode) {
  std::vector<Contact> contacts = test::ask_cpu(scene, pairs, {.mode = mode}).contacts;
  for (Contact& c : contacts) {
    if (pairs[c.pair].a != pairs[c.pair].b || c.face_a <= c.face_b) continue;
    std::swap(c.face_a, c.face_b);
    std::swap(c.triangle_a, c.triangle_b);
  }
  std::ranges::sort(contacts, {}, test::order_of);
  return contacts;
}

/// Numbers faces as if several triangles were cut of one, as in a mesh of polygons.
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
  test::RandomPoses random(21);
  const std::vector<ObjectPair> pairs = test::all_pairs(scene.instances, true, random);
  AskedContacts gpu(scene, pairs);
  for (const QueryMode mode : test::kModes) {
    const std::vector<Contact> expected = expected_of(scene, pairs, mode);
    EXPECT_GT(expected.size(), 10000u);
    for (int run = 0; run < 3; ++run) {  // first with too little room, then with enough, then with too much
      ASSERT_EQ(gpu.find(sorted(mode)), Status::kOk);
      EXPECT_EQ(gpu.stored(), expected);
    }
  }
}

TEST_F(GpuSorted, AGraphSortsAgainAndAnUnsortedQueryIsStillOne) {
  const BodyScene scene = test::pile(20, 500, 1, 22);
  const std::vector<ObjectPair> pairs = {{0, 1}, {7, 2}, {3, 3}, {4, 19}, {5, 6}};
  const std::vector<Contact> expected = expected_of(scene, pairs, QueryMode::exact);
  test::GraphStream stream;
  AskedContacts gpu(scene, pairs, Contents::all, stream.get());
  const GpuContactOptions options = sorted(QueryMode::exact);
  ASSERT_EQ(gpu.find(options, stream.get()), Status::kOk);
  stream.capture([&] { return gpu.enqueue(stream.get(), options); });
  for (int run = 0; run < 3; ++run) {
    ASSERT_EQ(gpu.find({}, stream.get()), Status::kOk);
    EXPECT_EQ(gpu.report().contacts, expected.size());
    stream.launch();
    EXPECT_EQ(gpu.stored(), expected);
  }
}

TEST_F(GpuSorted, WhatDoesNotFitOrFailsIsToldAsEver) {
  BodyScene scene = test::pile(10, 500, 1, 23);
  const std::vector<ObjectPair> pairs = {{0, 1}, {2, 3}, {4, 5}, {6, 7}};
  AskedContacts gpu(scene, pairs);
  test::expect_what_fits(gpu, sorted(QueryMode::exact));
  EXPECT_EQ(gpu.report().contacts, 50u);
  EXPECT_TRUE(std::ranges::is_sorted(gpu.stored(), {}, test::order_of));
  scene.instances[3].pose.rotation[0][0] += 1;
  test::expect_not_rigid(gpu, scene, pairs, sorted(QueryMode::exact));
  EXPECT_EQ(gpu.report().contacts, 0u);
}

}  // namespace
}  // namespace tandem
