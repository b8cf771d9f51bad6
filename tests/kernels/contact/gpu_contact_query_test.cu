#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/contact/only_walk.h"
#include "kernels/geometry/triangle_test.h"
#include "kernels/triangle_families.h"

namespace tandem {
namespace {

using test::all_pairs;
using test::AskedContacts;
using test::BodyScene;
using test::ContactAnswer;
using test::kModes;
using test::pile;
using test::RandomPoses;

/// Both answers to the same question.
struct Answers {
  ContactAnswer cpu, gpu;
};

Answers ask(const BodyScene& scene, const std::vector<ObjectPair>& pairs, QueryMode mode = QueryMode::exact,
            bool first_contact_only = false) {
  return {test::ask_cpu(scene, pairs, {.mode = mode, .first_contact_only = first_contact_only}),
          test::ask_gpu(scene, pairs, test::gpu_options(mode, first_contact_only))};
}

void expect_equal(const Answers& answers, QueryMode mode) {
  test::expect_equal(answers.gpu, answers.cpu, mode);
}

/// Both find the same in every mode, and more than so many contacts.
void expect_equal_in_every_mode(const BodyScene& scene, const std::vector<ObjectPair>& pairs,
                                std::size_t contacts) {
  for (const QueryMode mode : kModes) {
    const Answers answers = ask(scene, pairs, mode);
    EXPECT_GT(answers.cpu.contacts.size(), contacts);
    expect_equal(answers, mode);
  }
}

class GpuContacts : public test::GpuTest {};

class GpuContactsOf : public test::GpuTestOf<test::SceneFamily> {};

TEST_P(GpuContactsOf, AreThoseOfTheCpu) {
  RandomPoses random(1);
  for (int trial = 0; trial < test::trials(25, 20); ++trial) {
    const BodyScene scene = GetParam().make(random);
    const std::vector<ObjectPair> pairs = all_pairs(scene.instances, trial % 2 == 0, random);
    for (const QueryMode mode : kModes) {
      SCOPED_TRACE(testing::Message() << "trial " << trial << " mode " << static_cast<int>(mode) << '\n'
                                      << test::text(scene));
      expect_equal(ask(scene, pairs, mode), mode);
      if (HasFatalFailure() || HasNonfatalFailure()) return;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, GpuContactsOf, testing::ValuesIn(test::scene_families()),
                         [](const auto& family) { return std::string(family.param.name); });

TEST_F(GpuContacts, OfAPileAreThoseOfTheCpu) {
  RandomPoses random(2);
  const BodyScene scene = pile(150, 3000, 4, 7);
  expect_equal_in_every_mode(scene, all_pairs(scene.instances, false, random), 10000);
}

// One object pair: its work must be shared out among warps, and all of its triangles are hard cases.
TEST_F(GpuContacts, OfCoincidentBodiesAreThoseOfTheCpu) {
  RandomPoses random(3);
  BodyScene scene;
  scene.assets.add(test::cube(0.5f, 30));
  scene.assets.add(test::soup(random, 8000, 0.05));
  const Pose pose = random.pose({1, 1, 10, 0, 4});
  scene.instances = {{0, pose}, {0, pose}, {1, pose}, {1, pose}};
  for (const std::vector<ObjectPair>& pairs :
       {std::vector<ObjectPair>{{0, 1}}, std::vector<ObjectPair>{{3, 2}, {1, 1}}})
    expect_equal_in_every_mode(scene, pairs, 10000);
}

// Every node pair hits, so that stacks grow as fast as they can.
TEST_F(GpuContacts, OfRepeatedTrianglesAreAllPairs) {
  BodyScene scene;
  test::Mesh mesh;
  for (int i = 0; i < 700; ++i) mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0.5f});
  scene.assets.add(mesh);
  scene.instances = {{0, kIdentityPose}, {0, kIdentityPose}};
  for (const QueryMode mode : {QueryMode::exact, QueryMode::boxes}) {
    const Answers answers = ask(scene, {{0, 1}}, mode);
    EXPECT_EQ(answers.gpu.contacts.size(), 700u * 700u);
    expect_equal(answers, mode);
  }
}

TEST_F(GpuContacts, FarAwayAreThoseOfTheCpu) {
  RandomPoses random(4);
  for (const double far : {1e4, 1e7, 1e52}) {
    BodyScene scene = pile(20, far > 1e10 ? 40 : 1000, 1, 8);
    for (Instance& instance : scene.instances) instance.pose.translation[1] += far;
    const auto pairs = all_pairs(scene.instances, false, random);
    for (const QueryMode mode : kModes) expect_equal(ask(scene, pairs, mode), mode);
  }
}

TEST_F(GpuContacts, FirstOnesAreOfThePairsThatHaveAny) {
  RandomPoses random(5);
  const BodyScene scene = pile(60, 800, 3, 9);
  const auto pairs = all_pairs(scene.instances, false, random);
  for (const QueryMode mode : kModes) {
    const Answers all = ask(scene, pairs, mode);
    const Answers first = ask(scene, pairs, mode, true);
    test::expect_one_of_each_pair(first.gpu.contacts, all.cpu.contacts);
    EXPECT_EQ(first.gpu.counters.contacts, first.gpu.contacts.size());
    EXPECT_LE(first.gpu.counters.block_pairs, all.gpu.counters.block_pairs);
  }
}

// This scene is for tools that are too slow for larger ones.
TEST_F(GpuContacts, OfASmallSceneInEveryMode) {
  RandomPoses random(15);
  const BodyScene scene = pile(10, 150, 0.7, 15);
  const auto pairs = all_pairs(scene.instances, true, random);
  expect_equal_in_every_mode(scene, pairs, 100);
  for (const QueryMode mode : kModes) {
    const Answers first = ask(scene, pairs, mode, true);
    EXPECT_EQ(first.gpu.contacts.size(), first.cpu.contacts.size());
  }
}

TEST_F(GpuContacts, ThatDoNotFitAreAskedForAndFoundOnTheRetry) {
  RandomPoses random(6);
  const BodyScene scene = pile(40, 800, 2, 10);
  const auto pairs = all_pairs(scene.instances, false, random);
  const std::vector<Contact> expected = ask(scene, pairs).cpu.contacts;
  AskedContacts gpu(scene, pairs);
  ASSERT_EQ(gpu.query.reserve({10, 100, 0}), Status::kOk);
  gpu.run(GpuContactOptions{});
  EXPECT_EQ(gpu.report().status, Status::kOk);
  EXPECT_EQ(gpu.report().complete, 0u);
  EXPECT_EQ(gpu.report().needed.pairs, pairs.size());
  EXPECT_LE(gpu.report().contacts, 100u);

  ASSERT_EQ(gpu.query.reserve({gpu.report().needed.pairs, 100, 0}), Status::kOk);
  gpu.run(GpuContactOptions{});
  EXPECT_EQ(gpu.report().complete, 0u);
  EXPECT_EQ(gpu.report().contacts, 100u);
  EXPECT_GT(gpu.report().needed.contacts, 100u);
  EXPECT_LE(gpu.report().needed.contacts, expected.size());

  ASSERT_EQ(gpu.find(), Status::kOk);
  const GpuContactCapacity settled = gpu.query.capacity();
  for (int run = 0; run < 2; ++run) {
    EXPECT_EQ(gpu.report().complete, 1u);
    EXPECT_EQ(gpu.contacts(), expected);
    gpu.run(GpuContactOptions{});
  }
  EXPECT_EQ(gpu.query.capacity().contacts, settled.contacts);
}

TEST_F(GpuContacts, OfMorePairsThanTheirArrayHoldsAreNotComplete) {
  const BodyScene scene = pile(4, 100, 1, 11);
  AskedContacts gpu(scene, {{0, 1}, {0, 2}, {0, 3}});
  GpuPairs pairs = gpu.scene.pairs();
  pairs.capacity = 2;
  EXPECT_EQ(gpu.query.find_contacts(gpu.scene.instances(), pairs, {}, nullptr), Status::kOutOfRange);
  EXPECT_EQ(gpu.report().complete, 0u);
  EXPECT_EQ(gpu.report().needed.pairs, 3u);
}

TEST_F(GpuContacts, OfNothingAreNone) {
  BodyScene scene = pile(2, 100, 1, 11);
  for (const bool instances : {true, false}) {
    if (!instances) scene.instances.clear();
    AskedContacts gpu(scene, {});
    ASSERT_EQ(gpu.find(), Status::kOk);
    EXPECT_EQ(gpu.report().contacts, 0u);
    EXPECT_EQ(gpu.report().counters, ContactCounters());
  }
}

TEST_F(GpuContacts, NameWhatIsWrong) {
  BodyScene scene = pile(50, 100, 1, 12);
  std::vector<ObjectPair> pairs;
  for (std::uint32_t i = 1; i < 50; ++i) pairs.push_back({0, i});
  const auto expect = [&](Status status, std::uint64_t where) {
    const auto [cpu, gpu] = ask(scene, pairs);
    EXPECT_EQ(gpu.status, status);
    EXPECT_EQ(gpu.where, where);
    EXPECT_TRUE(gpu.contacts.empty());
    EXPECT_EQ(cpu.status, status);
    EXPECT_EQ(cpu.where, where);
  };
  pairs[20].b = 50;
  expect(Status::kUnknownInstance, 20);
  scene.instances[40].asset = 2;
  expect(Status::kUnknownAsset, 40);
  scene.instances[33].pose.rotation[1][1] += 1e-3;
  expect(Status::kPoseNotRigid, 33);
  scene.instances[32].pose.translation[2] = NAN;
  expect(Status::kPoseNotRigid, 32);
  scene.instances[31].pose.translation[2] = 1e301;
  expect(Status::kOutOfRange, 31);
}

TEST_F(GpuContacts, AreTheSameOnEveryRunSideBySideAndInAGraph) {
  RandomPoses random(13);
  const BodyScene scene = pile(100, 1500, 3, 13);
  const auto pairs = all_pairs(scene.instances, false, random);
  const std::vector<Contact> expected = ask(scene, pairs).cpu.contacts;
  test::GraphStream streams[3];
  std::vector<AskedContacts> queries;
  for (const test::GraphStream& stream : streams) {
    queries.emplace_back(scene, pairs, Contents::all, stream.get());
    ASSERT_EQ(queries.back().find({}, stream.get()), Status::kOk);
  }
  for (int run = 0; run < 10; ++run) {
    for (int i = 0; i < 3; ++i)
      ASSERT_EQ(queries[i].enqueue(streams[i].get(), GpuContactOptions{}), Status::kOk);
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(cudaStreamSynchronize(streams[i].get()), cudaSuccess);
      EXPECT_EQ(queries[i].report().complete, 1u);
      ASSERT_EQ(queries[i].contacts(), expected);
    }
  }
  streams[0].capture([&] { return queries[0].enqueue(streams[0].get(), GpuContactOptions{}); });
  for (int run = 0; run < 3; ++run) {
    streams[0].launch();
    EXPECT_EQ(queries[0].contacts(), expected);
  }
}

/// Compiled apart from the whole query, with other operations fused, so the counts may differ by a little.
TEST_F(GpuContacts, AreNoneWhereTheTreesAreWalkedOnly) {
  RandomPoses random(21);
  const BodyScene scene = pile(60, 1500, 3, 21);
  AskedContacts gpu(scene, all_pairs(scene.instances, false, random));
  ASSERT_EQ(gpu.find(), Status::kOk);
  const std::vector<Contact> contacts = gpu.contacts();
  const ContactCounters whole = gpu.report().counters;
  ASSERT_GT(contacts.size(), 100u);
  only_walk(gpu.query, true);
  ASSERT_EQ(gpu.find(), Status::kOk);
  const ContactCounters walk = gpu.report().counters;
  EXPECT_EQ(gpu.report().contacts, 0u);
  EXPECT_EQ(walk.decided_by_float32 + walk.decided_by_float64 + walk.decided_exactly, 0u);
  EXPECT_NEAR(static_cast<double>(walk.block_pairs), static_cast<double>(whole.block_pairs),
              1e-3 * static_cast<double>(whole.block_pairs));
  EXPECT_NEAR(static_cast<double>(walk.candidates), static_cast<double>(whole.candidates),
              1e-3 * static_cast<double>(whole.candidates));
  only_walk(gpu.query, false);
  ASSERT_EQ(gpu.find(), Status::kOk);
  EXPECT_EQ(gpu.contacts(), contacts);
}

/// Keeps multiprocessors busy, each with a block that leaves no shared memory.
__global__ void hold(const volatile int* released) {
  while (*released == 0) __nanosleep(1000);
}

bool is_done_within_seconds(cudaStream_t stream, int seconds) {
  for (int i = 0; i < 1000 * seconds; ++i) {
    if (cudaStreamQuery(stream) != cudaErrorNotReady) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

/// All multiprocessors but one are held, so that blocks run one after another, and those of the first block
/// of the walk have nothing to do: it has gone home when the next, which have much to share, begin.
TEST_F(GpuContacts, DoNotDependOnWhenBlocksBegin) {
  if (std::getenv("TANDEM_GPU_BLOCKS") != nullptr) GTEST_SKIP() << "with few blocks none is late";
  RandomPoses random(31);
  BodyScene scene = pile(60, 1500, 2, 31);
  const auto close = all_pairs(scene.instances, false, random);
  const auto far = static_cast<std::uint32_t>(scene.instances.size());
  scene.instances.push_back({0, random.pose({1, 1, 0, 0, 0})});
  scene.instances[far].pose.translation[0] += 1000;
  int processors = 0;
  ASSERT_EQ(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, 0), cudaSuccess);
  std::vector<ObjectPair> pairs;
  for (int i = 0; i < 4000; ++i) {
    const bool of_first_block = i / 4 % processors == 0;
    pairs.push_back(of_first_block ? ObjectPair{0, far} : close[static_cast<std::size_t>(i) % close.size()]);
  }
  const std::vector<Contact> expected = ask(scene, pairs).cpu.contacts;
  GpuStream streams[2];
  for (GpuStream& stream : streams) ASSERT_EQ(stream.create(), cudaSuccess);
  AskedContacts gpu(scene, pairs, Contents::all, streams[0].get());
  ASSERT_EQ(gpu.find({}, streams[0].get()), Status::kOk);
  int bytes = 0;
  ASSERT_EQ(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, 0), cudaSuccess);
  ASSERT_EQ(cudaFuncSetAttribute(hold, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes), cudaSuccess);
  PinnedArray<int> released;
  ASSERT_EQ(released.reserve(1), cudaSuccess);
  *released = 0;
  hold<<<processors - 1, 32, bytes, streams[1].get()>>>(released.data());
  ASSERT_EQ(cudaGetLastError(), cudaSuccess);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_EQ(gpu.enqueue(streams[0].get(), GpuContactOptions{}), Status::kOk);
  const bool done = is_done_within_seconds(streams[0].get(), 20);
  *static_cast<volatile int*>(released.data()) = 1;
  if (!done && !is_done_within_seconds(streams[0].get(), 2)) {
    std::fprintf(stderr, "a query hangs where its blocks begin one after another\n");
    std::_Exit(1);  // nothing else can be done with the GPU
  }
  EXPECT_TRUE(done);
  EXPECT_EQ(gpu.contacts(), expected);
  ASSERT_EQ(streams[1].wait(), cudaSuccess);
}

TEST_F(GpuContacts, MoveFromOneOwnerToAnother) {
  const BodyScene scene = pile(10, 300, 1, 14);
  AskedContacts first(scene, {{0, 1}, {2, 3}});
  ASSERT_EQ(first.find(), Status::kOk);
  const std::vector<Contact> expected = first.contacts();
  AskedContacts second = std::move(first);
  EXPECT_EQ(second.contacts(), expected);
  ASSERT_EQ(second.find(), Status::kOk);
  EXPECT_EQ(second.contacts(), expected);
}

struct Decided {
  Verdict float64, exact;
};

__global__ void decide_all(const TrianglePair* pairs, int count, Decided* out) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) out[i] = {decide_float64(pairs[i]), decide_exact(pairs[i])};
}

class GpuTriangles : public test::GpuTestOf<TriangleFamily> {};

TEST_P(GpuTriangles, AreDecidedAsOnTheCpu) {
  Random random(1);
  std::vector<TrianglePair> pairs;
  for (int i = 0; i < test::trials(20000, 50); ++i) pairs.push_back(GetParam().make(random));
  const int count = static_cast<int>(pairs.size());
  const auto device = test::on_gpu(pairs);
  const auto decided = test::on_gpu(std::vector<Decided>(pairs.size()));
  decide_all<<<(count + 63) / 64, 64>>>(device.data(), count, decided.data());
  ASSERT_EQ(cudaGetLastError(), cudaSuccess);
  ASSERT_EQ(cudaDeviceSynchronize(), cudaSuccess);
  const std::vector<Decided> found = test::download(decided.data(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Verdict expected = decide_exact(pairs[i]);
    ASSERT_EQ(found[i].exact, expected) << "pair " << i;
    if (found[i].float64 != Verdict::undecided) ASSERT_EQ(found[i].float64, expected) << "pair " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(, GpuTriangles, testing::ValuesIn(triangle_families()),
                         [](const auto& tested) { return test::family_name(tested); });

}  // namespace
}  // namespace tandem
