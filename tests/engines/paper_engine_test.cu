#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bvhbench/engines/paper/paper_engine.h"
#include "gpu/gpu_scene_fixture.h"
#include "kernels/query_scenes.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/runtime/upload.h"

namespace tandem::bench {
namespace {

using test::all_pairs;
using test::BodyScene;
using test::download;
using test::GpuScene;
using test::pile;
using test::RandomPoses;
using test::sorted;

constexpr PaperFlags kFlags[] = {PaperFlags::words, PaperFlags::bits};

std::vector<Contact> contacts_of(const PaperEngine& engine) {
  return sorted(download(engine.contacts(), engine.report().counters.contacts));
}

Status ask(PaperEngine& engine, const GpuScene& scene, const PaperOptions& options) {
  const Status status = engine.find_contacts(scene.instances(), scene.pairs(), options, nullptr);
  EXPECT_EQ(engine.cuda_error(), cudaSuccess) << cudaGetErrorString(engine.cuda_error());
  return status;
}

/// An engine that knows the assets of a scene.
PaperEngine engine_of(const GpuScene& scene) {
  PaperEngine engine;
  EXPECT_EQ(engine.set_assets(scene.assets(), nullptr), Status::kOk)
      << cudaGetErrorString(engine.cuda_error());
  return engine;
}

/// The exact contacts, by every way of storing flags.
void expect_contacts(PaperEngine& engine, const GpuScene& scene, const test::ContactAnswer& expected) {
  std::uint64_t block_pairs = 0;
  for (const PaperFlags flags : kFlags) {
    SCOPED_TRACE(testing::Message() << "flags " << static_cast<int>(flags));
    ASSERT_EQ(ask(engine, scene, {QueryMode::exact, flags}), Status::kOk);
    const ContactCounters& counters = engine.report().counters;
    ASSERT_EQ(counters.contacts, expected.contacts.size());
    ASSERT_EQ(contacts_of(engine), expected.contacts);
    EXPECT_EQ(counters.candidates,
              counters.decided_by_float32 + counters.decided_by_float64 + counters.decided_exactly);
    if (flags == kFlags[0]) block_pairs = counters.block_pairs;
    EXPECT_EQ(counters.block_pairs, block_pairs);
  }
}

void expect_contacts_of(const BodyScene& scene, const std::vector<ObjectPair>& pairs) {
  const test::ContactAnswer expected = test::ask_cpu(scene, pairs);
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  PaperEngine engine = engine_of(on_gpu);
  if (expected.status == Status::kOk) return expect_contacts(engine, on_gpu, expected);
  EXPECT_EQ(ask(engine, on_gpu, {}), expected.status);
  EXPECT_EQ(engine.report().where, expected.where);
}

class PaperContacts : public test::GpuTest {};

class PaperContactsOf : public test::GpuTestOf<test::SceneFamily> {};

/// Whether the float32 box tests take every pair, which is what the engine can do.
bool in_reach(const BodyScene& scene, const std::vector<ObjectPair>& pairs) {
  const auto pose = [&](const Instance& instance) {
    return for_stored_coordinates(instance.pose, scene.assets.views()[instance.asset].header->origin);
  };
  const auto extent = [&](const Instance& instance) {
    return extent_of(scene.assets.views()[instance.asset].level().blocks[0]);
  };
  return std::all_of(pairs.begin(), pairs.end(), [&](const ObjectPair& pair) {
    const Instance &a = scene.instances[pair.a], &b = scene.instances[pair.b];
    RelativePose out;
    return relative_pose(pose(a), extent(a), pose(b), extent(b), out) == RelativePoseStatus::kOk;
  });
}

TEST_P(PaperContactsOf, AreThoseOfTheCpu) {
  RandomPoses random(1);
  for (int trial = 0; trial < test::trials(15, 20); ++trial) {
    const BodyScene scene = GetParam().make(random);
    const std::vector<ObjectPair> pairs = all_pairs(scene.instances, trial % 2 == 0, random);
    SCOPED_TRACE(testing::Message() << "trial " << trial << '\n' << test::text(scene));
    if (in_reach(scene, pairs)) {
      expect_contacts_of(scene, pairs);
    } else {
      const GpuScene on_gpu(scene.assets, scene.instances, pairs);
      PaperEngine engine = engine_of(on_gpu);
      EXPECT_EQ(ask(engine, on_gpu, {}), Status::kOutOfRange);
    }
    if (HasFatalFailure() || HasNonfatalFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(, PaperContactsOf, testing::ValuesIn(test::scene_families()),
                         [](const auto& family) { return std::string(family.param.name); });

/// Cubes that touch, face on face: every candidate is a hard case.
BodyScene stack(int side, int cells) {
  BodyScene scene;
  scene.assets.add(test::cube(0.5f, cells));
  for (int i = 0; i < side * side * side; ++i) {
    Pose pose = kIdentityPose;
    pose.translation[0] = i % side, pose.translation[1] = i / side % side,
    pose.translation[2] = i / side / side;
    scene.instances.push_back({0, pose});
  }
  return scene;
}

TEST_F(PaperContacts, OfAPileAreThoseOfTheCpu) {
  RandomPoses random(2);
  const BodyScene scene = pile(150, 3000, 4, 7);
  const auto pairs = all_pairs(scene.instances, false, random);
  EXPECT_GT(test::ask_cpu(scene, pairs).contacts.size(), 10000u);
  expect_contacts_of(scene, pairs);
}

TEST_F(PaperContacts, OfAnExactStackAreThoseOfTheCpu) {
  RandomPoses random(3);
  const BodyScene scene = stack(4, 3);
  const auto pairs = all_pairs(scene.instances, true, random);
  EXPECT_GT(test::ask_cpu(scene, pairs).contacts.size(), 10000u);
  expect_contacts_of(scene, pairs);
}

// Trees of different depths: one side descends alone for long.
TEST_F(PaperContacts, OfALargeBodyAndASmallOneAreThoseOfTheCpu) {
  RandomPoses random(4);
  BodyScene scene;
  scene.assets.add(test::soup(random, 8000, 0.05));
  scene.assets.add(test::cube(0.5f));
  test::Mesh one;
  one.add({-2, 0, 0}, {2, 0, 0}, {0, 2, 0.5f});
  scene.assets.add(one);
  for (const std::uint32_t asset : {0u, 1u, 2u, 0u})
    scene.instances.push_back({asset, random.pose({1, 1, 0.2, 0, 4})});
  expect_contacts_of(scene, all_pairs(scene.instances, true, random));
}

// Candidates are those that every node pair of the leaves says, each once: no flag is lost and none is
// double.
TEST_F(PaperContacts, OfRepeatedTrianglesAreAllPairs) {
  BodyScene scene;
  test::Mesh mesh;
  for (int i = 0; i < 700; ++i) mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0.5f});
  scene.assets.add(mesh);
  test::Mesh few;
  for (int i = 0; i < 7; ++i) few.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0.5f});
  scene.assets.add(few);
  scene.instances = {{0, kIdentityPose}, {0, kIdentityPose}, {1, kIdentityPose}};
  const std::vector<ObjectPair> pairs = {{0, 1}, {2, 1}, {0, 2}};
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  PaperEngine engine = engine_of(on_gpu);
  for (const PaperFlags flags : kFlags) {
    for (const QueryMode mode : {QueryMode::boxes, QueryMode::exact, QueryMode::fast}) {
      ASSERT_EQ(ask(engine, on_gpu, {mode, flags}), Status::kOk);
      const std::vector<Contact> contacts = contacts_of(engine);
      EXPECT_EQ(contacts.size(), 700u * 700u + 2u * 7u * 700u);
      EXPECT_TRUE(std::adjacent_find(contacts.begin(), contacts.end()) == contacts.end());
    }
  }
}

TEST_F(PaperContacts, OfBoxesIncludeAllContacts) {
  RandomPoses random(5);
  const BodyScene scene = pile(60, 800, 3, 9);
  const auto pairs = all_pairs(scene.instances, true, random);
  const test::ContactAnswer expected = test::ask_cpu(scene, pairs);
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  PaperEngine engine = engine_of(on_gpu);
  ASSERT_EQ(ask(engine, on_gpu, {QueryMode::boxes, PaperFlags::bits}), Status::kOk);
  const std::vector<Contact> boxes = contacts_of(engine);
  EXPECT_TRUE(std::adjacent_find(boxes.begin(), boxes.end()) == boxes.end());
  EXPECT_TRUE(std::includes(boxes.begin(), boxes.end(), expected.contacts.begin(), expected.contacts.end(),
                            test::comes_before));
}

TEST_F(PaperContacts, OfLargerAndLargerScenesNeedNoNewEngine) {
  RandomPoses random(6);
  PaperEngine engine;
  std::size_t bytes = 0;
  for (const std::uint32_t bodies : {4u, 30u, 90u}) {
    const BodyScene scene = pile(bodies, 800, 2, 10);
    const auto pairs = all_pairs(scene.instances, false, random);
    const test::ContactAnswer expected = test::ask_cpu(scene, pairs);
    const GpuScene on_gpu(scene.assets, scene.instances, pairs);
    ASSERT_EQ(engine.set_assets(on_gpu.assets(), nullptr), Status::kOk);
    expect_contacts(engine, on_gpu, expected);
    EXPECT_GT(engine.bytes(), bytes);
    bytes = engine.bytes();
    for (int again = 0; again < 3; ++again) expect_contacts(engine, on_gpu, expected);
    EXPECT_EQ(engine.bytes(), bytes);  // settled
  }
  const BodyScene small = pile(3, 100, 1, 11);
  const auto pairs = all_pairs(small.instances, false, random);
  const GpuScene on_gpu(small.assets, small.instances, pairs);
  ASSERT_EQ(engine.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  expect_contacts(engine, on_gpu, test::ask_cpu(small, pairs));
}

TEST_F(PaperContacts, OfNothingAreNone) {
  for (const bool instances : {false, true}) {
    BodyScene scene = pile(2, 100, 1, 11);
    if (!instances) scene.instances.clear();
    const GpuScene on_gpu(scene.assets, scene.instances, {});
    PaperEngine engine = engine_of(on_gpu);
    EXPECT_EQ(ask(engine, on_gpu, {}), Status::kOk);
    EXPECT_EQ(engine.report().counters, ContactCounters());
    EXPECT_EQ(engine.report().levels, 0u);
  }
}

TEST_F(PaperContacts, NameWhatIsWrong) {
  BodyScene scene = pile(50, 100, 1, 12);
  std::vector<ObjectPair> pairs;
  for (std::uint32_t i = 1; i < 50; ++i) pairs.push_back({0, i});
  const auto expect = [&](Status status, std::uint64_t where) {
    const test::ContactAnswer expected = test::ask_cpu(scene, pairs);
    EXPECT_EQ(expected.status, status);
    EXPECT_EQ(expected.where, where);
    expect_contacts_of(scene, pairs);
  };
  pairs[20].b = 50;
  expect(Status::kUnknownInstance, 20);
  scene.instances[40].asset = 2;
  expect(Status::kUnknownAsset, 40);
  scene.instances[33].pose.rotation[1][1] += 1e-3;
  expect(Status::kPoseNotRigid, 33);
}

TEST_F(PaperContacts, OutOfReachOfFloat32AreRefused) {
  BodyScene scene = pile(4, 40, 1, 8);
  for (Instance& instance : scene.instances) instance.pose.translation[1] += 1e52;
  const GpuScene on_gpu(scene.assets, scene.instances, {{0, 1}, {2, 3}});
  PaperEngine engine = engine_of(on_gpu);
  EXPECT_EQ(ask(engine, on_gpu, {}), Status::kOutOfRange);
  EXPECT_EQ(engine.report().counters.contacts, 0u);
  GpuPairs pairs = on_gpu.pairs();
  pairs.capacity = 1;
  EXPECT_EQ(engine.find_contacts(on_gpu.instances(), pairs, {}, nullptr), Status::kOutOfRange);
}

TEST_F(PaperContacts, MoveFromOneOwnerToAnother) {
  const BodyScene scene = pile(10, 300, 1, 14);
  const GpuScene on_gpu(scene.assets, scene.instances, {{0, 1}, {2, 3}});
  PaperEngine first = engine_of(on_gpu);
  ASSERT_EQ(ask(first, on_gpu, {}), Status::kOk);
  const auto expected = contacts_of(first);
  EXPECT_FALSE(expected.empty());
  PaperEngine second = std::move(first);
  EXPECT_EQ(contacts_of(second), expected);
  ASSERT_EQ(ask(second, on_gpu, {}), Status::kOk);
  EXPECT_EQ(contacts_of(second), expected);
}

}  // namespace
}  // namespace tandem::bench
