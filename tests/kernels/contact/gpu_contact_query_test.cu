#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <thread>
#include <tuple>
#include <vector>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/geometry/triangle_test.h"
#include "kernels/query_scenes.h"
#include "kernels/triangle_families.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/runtime/upload.h"

namespace tandem {
namespace {

using test::all_pairs;
using test::BodyScene;
using test::download;
using test::GpuScene;
using test::on_gpu;
using test::pile;
using test::RandomPoses;
using test::sorted;

constexpr QueryMode kModes[] = {QueryMode::exact, QueryMode::fast, QueryMode::boxes};

std::vector<Contact> contacts_of(const GpuContactQuery& query) {
  return sorted(download(query.contacts(), query.report().contacts));
}

/// Both answers to the same question.
struct Answers {
  Status cpu_status, gpu_status;
  std::uint64_t cpu_where = 0, gpu_where = 0;
  std::vector<Contact> cpu, gpu;
  ContactCounters cpu_counters, gpu_counters;
};

Answers ask(const test::SampleAssets& assets, const std::vector<Instance>& instances,
            const std::vector<ObjectPair>& pairs, QueryMode mode, bool first_contact_only = false) {
  Answers out;
  ContactQuery cpu;
  EXPECT_EQ(cpu.set_assets(assets.views()), Status::kOk);
  ContactOptions options;
  options.mode = mode;
  options.first_contact_only = first_contact_only;
  out.cpu_status = cpu.find_contacts(instances, pairs, options);
  out.cpu_where = cpu.where();
  out.cpu = sorted({cpu.contacts().begin(), cpu.contacts().end()});
  out.cpu_counters = cpu.counters();

  const GpuScene scene(assets, instances, pairs);
  GpuContactQuery gpu;
  EXPECT_EQ(gpu.set_assets(scene.assets(), nullptr), Status::kOk) << cudaGetErrorString(gpu.cuda_error());
  const GpuContactOptions gpu_options = test::gpu_options(mode, first_contact_only);
  out.gpu_status = gpu.find_contacts(scene.instances(), scene.pairs(), gpu_options, nullptr);
  EXPECT_EQ(gpu.cuda_error(), cudaSuccess) << cudaGetErrorString(gpu.cuda_error());
  out.gpu_where = gpu.report().where;
  out.gpu = contacts_of(gpu);
  out.gpu_counters = gpu.report().counters;
  return out;
}

void expect_equal(const Answers& answers, QueryMode mode) {
  ASSERT_EQ(answers.gpu_status, answers.cpu_status);
  if (answers.cpu_status != Status::kOk) EXPECT_EQ(answers.gpu_where, answers.cpu_where);
  ASSERT_EQ(answers.gpu.size(), answers.cpu.size());
  EXPECT_EQ(answers.gpu, answers.cpu);
  EXPECT_EQ(answers.gpu_counters.contacts, answers.cpu_counters.contacts);
  EXPECT_EQ(answers.gpu_counters.object_pairs, answers.cpu_counters.object_pairs);
  if (mode == QueryMode::exact) return;  // fused operations may shift candidates within the slack
  EXPECT_EQ(answers.gpu_counters.block_pairs, answers.cpu_counters.block_pairs);
  EXPECT_EQ(answers.gpu_counters.candidates, answers.cpu_counters.candidates);
  EXPECT_EQ(answers.gpu_counters.decided_by_float32, answers.cpu_counters.decided_by_float32);
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
      expect_equal(ask(scene.assets, scene.instances, pairs, mode), mode);
      if (HasFatalFailure() || HasNonfatalFailure()) return;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, GpuContactsOf, testing::ValuesIn(test::scene_families()),
                         [](const auto& family) { return std::string(family.param.name); });

TEST_F(GpuContacts, OfAPileAreThoseOfTheCpu) {
  RandomPoses random(2);
  const BodyScene scene = pile(150, 3000, 4, 7);
  const auto pairs = all_pairs(scene.instances, false, random);
  for (const QueryMode mode : kModes) {
    const Answers answers = ask(scene.assets, scene.instances, pairs, mode);
    EXPECT_GT(answers.cpu.size(), 10000u);
    expect_equal(answers, mode);
  }
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
       {std::vector<ObjectPair>{{0, 1}}, std::vector<ObjectPair>{{3, 2}, {1, 1}}}) {
    for (const QueryMode mode : kModes) {
      const Answers answers = ask(scene.assets, scene.instances, pairs, mode);
      EXPECT_GT(answers.cpu.size(), 10000u);
      expect_equal(answers, mode);
    }
  }
}

// Every node pair hits, so that stacks grow as fast as they can.
TEST_F(GpuContacts, OfRepeatedTrianglesAreAllPairs) {
  BodyScene scene;
  test::Mesh mesh;
  for (int i = 0; i < 700; ++i) mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0.5f});
  scene.assets.add(mesh);
  scene.instances = {{0, kIdentityPose}, {0, kIdentityPose}};
  for (const QueryMode mode : {QueryMode::exact, QueryMode::boxes}) {
    const Answers answers = ask(scene.assets, scene.instances, {{0, 1}}, mode);
    EXPECT_EQ(answers.gpu.size(), 700u * 700u);
    expect_equal(answers, mode);
  }
}

TEST_F(GpuContacts, FarAwayAreThoseOfTheCpu) {
  RandomPoses random(4);
  for (const double far : {1e4, 1e7, 1e52}) {
    BodyScene scene = pile(20, far > 1e10 ? 40 : 1000, 1, 8);
    for (Instance& instance : scene.instances) instance.pose.translation[1] += far;
    const auto pairs = all_pairs(scene.instances, false, random);
    for (const QueryMode mode : kModes) expect_equal(ask(scene.assets, scene.instances, pairs, mode), mode);
  }
}

TEST_F(GpuContacts, FirstOnesAreOfThePairsThatHaveAny) {
  RandomPoses random(5);
  const BodyScene scene = pile(60, 800, 3, 9);
  const auto pairs = all_pairs(scene.instances, false, random);
  for (const QueryMode mode : kModes) {
    const Answers all = ask(scene.assets, scene.instances, pairs, mode);
    const Answers first = ask(scene.assets, scene.instances, pairs, mode, true);
    std::map<std::uint32_t, int> wanted, found;
    for (const Contact& contact : all.cpu) wanted[contact.pair] = 1;
    for (const Contact& contact : first.gpu) {
      ++found[contact.pair];
      EXPECT_TRUE(std::binary_search(all.cpu.begin(), all.cpu.end(), contact, test::comes_before));
    }
    EXPECT_EQ(found, wanted);
    EXPECT_EQ(first.gpu_counters.contacts, wanted.size());
    EXPECT_LE(first.gpu_counters.block_pairs, all.gpu_counters.block_pairs);
  }
}

// For tools that are too slow for more.
TEST_F(GpuContacts, OfASmallSceneInEveryMode) {
  RandomPoses random(15);
  const BodyScene scene = pile(10, 150, 0.7, 15);
  const auto pairs = all_pairs(scene.instances, true, random);
  for (const QueryMode mode : kModes) {
    const Answers all = ask(scene.assets, scene.instances, pairs, mode);
    EXPECT_GT(all.cpu.size(), 100u);
    expect_equal(all, mode);
    const Answers first = ask(scene.assets, scene.instances, pairs, mode, true);
    EXPECT_EQ(first.gpu.size(), first.cpu.size());
  }
}

TEST_F(GpuContacts, ThatDoNotFitAreAskedForAndFoundOnTheRetry) {
  RandomPoses random(6);
  const BodyScene scene = pile(40, 800, 2, 10);
  const auto pairs = all_pairs(scene.instances, false, random);
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  const Answers expected = ask(scene.assets, scene.instances, pairs, QueryMode::exact);
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  ASSERT_EQ(query.reserve({10, 100, 0}), Status::kOk);
  ASSERT_EQ(query.enqueue(on_gpu.instances(), on_gpu.pairs(), {}, nullptr), Status::kOk);
  ASSERT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  EXPECT_EQ(query.report().status, Status::kOk);
  EXPECT_EQ(query.report().complete, 0u);
  EXPECT_EQ(query.report().needed.pairs, pairs.size());
  EXPECT_LE(query.report().contacts, 100u);

  ASSERT_EQ(query.reserve({query.report().needed.pairs, 100, 0}), Status::kOk);
  ASSERT_EQ(query.enqueue(on_gpu.instances(), on_gpu.pairs(), {}, nullptr), Status::kOk);
  ASSERT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  EXPECT_EQ(query.report().complete, 0u);
  EXPECT_EQ(query.report().contacts, 100u);
  EXPECT_GT(query.report().needed.contacts, 100u);
  EXPECT_LE(query.report().needed.contacts, expected.cpu.size());

  ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), {}, nullptr), Status::kOk);
  EXPECT_EQ(query.report().complete, 1u);
  EXPECT_EQ(contacts_of(query), expected.cpu);
  const GpuContactCapacity settled = query.capacity();
  ASSERT_EQ(query.enqueue(on_gpu.instances(), on_gpu.pairs(), {}, nullptr), Status::kOk);
  ASSERT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  EXPECT_EQ(query.report().complete, 1u);
  EXPECT_EQ(contacts_of(query), expected.cpu);
  EXPECT_EQ(query.capacity().contacts, settled.contacts);
}

TEST_F(GpuContacts, OfMorePairsThanTheirArrayHoldsAreNotComplete) {
  const BodyScene scene = pile(4, 100, 1, 11);
  const GpuScene on_gpu(scene.assets, scene.instances, {{0, 1}, {0, 2}, {0, 3}});
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  GpuPairs pairs = on_gpu.pairs();
  pairs.capacity = 2;
  EXPECT_EQ(query.find_contacts(on_gpu.instances(), pairs, {}, nullptr), Status::kOutOfRange);
  EXPECT_EQ(query.report().complete, 0u);
  EXPECT_EQ(query.report().needed.pairs, 3u);
}

TEST_F(GpuContacts, OfNothingAreNone) {
  const BodyScene scene = pile(2, 100, 1, 11);
  for (const bool instances : {false, true}) {
    const GpuScene on_gpu(scene.assets, instances ? scene.instances : std::vector<Instance>(), {});
    GpuContactQuery query;
    ASSERT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kOk);
    ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), {}, nullptr), Status::kOk);
    EXPECT_EQ(query.report().contacts, 0u);
    EXPECT_EQ(query.report().counters, ContactCounters());
  }
}

TEST_F(GpuContacts, NameWhatIsWrong) {
  BodyScene scene = pile(50, 100, 1, 12);
  std::vector<ObjectPair> pairs;
  for (std::uint32_t i = 1; i < 50; ++i) pairs.push_back({0, i});
  const auto expect = [&](Status status, std::uint64_t where) {
    const Answers answers = ask(scene.assets, scene.instances, pairs, QueryMode::exact);
    EXPECT_EQ(answers.gpu_status, status);
    EXPECT_EQ(answers.gpu_where, where);
    EXPECT_TRUE(answers.gpu.empty());
    EXPECT_EQ(answers.cpu_status, status);
    EXPECT_EQ(answers.cpu_where, where);
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
  const Answers expected = ask(scene.assets, scene.instances, pairs, QueryMode::exact);
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  constexpr int kQueries = 3;
  GpuContactQuery queries[kQueries];
  GpuStream streams[kQueries];
  for (int i = 0; i < kQueries; ++i) {
    ASSERT_EQ(streams[i].create(), cudaSuccess);
    ASSERT_EQ(queries[i].set_assets(on_gpu.assets(), streams[i].get()), Status::kOk);
    ASSERT_EQ(queries[i].find_contacts(on_gpu.instances(), on_gpu.pairs(), {}, streams[i].get()),
              Status::kOk);
  }
  for (int run = 0; run < 10; ++run) {
    for (int i = 0; i < kQueries; ++i) {
      ASSERT_EQ(queries[i].enqueue(on_gpu.instances(), on_gpu.pairs(), {}, streams[i].get()), Status::kOk);
    }
    for (int i = 0; i < kQueries; ++i) {
      ASSERT_EQ(streams[i].wait(), cudaSuccess);
      EXPECT_EQ(queries[i].report().complete, 1u);
      ASSERT_EQ(contacts_of(queries[i]), expected.cpu);
    }
  }
  GpuGraph graph;
  const auto enqueue = [&] {
    EXPECT_EQ(queries[0].enqueue(on_gpu.instances(), on_gpu.pairs(), {}, streams[0].get()), Status::kOk);
  };
  ASSERT_EQ(graph.capture(streams[0].get(), enqueue), cudaSuccess);
  for (int run = 0; run < 3; ++run) {
    ASSERT_EQ(graph.launch(streams[0].get()), cudaSuccess);
    ASSERT_EQ(streams[0].wait(), cudaSuccess);
    EXPECT_EQ(contacts_of(queries[0]), expected.cpu);
  }
}

/// Compiled apart from the whole query, with other operations fused, so the counts may differ by a little.
TEST_F(GpuContacts, AreNoneWhereTheTreesAreWalkedOnly) {
  RandomPoses random(21);
  const BodyScene scene = pile(60, 1500, 3, 21);
  const GpuScene on_gpu(scene.assets, scene.instances, all_pairs(scene.instances, false, random));
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), {}, nullptr), Status::kOk);
  const auto contacts = contacts_of(query);
  const ContactCounters whole = query.report().counters;
  ASSERT_GT(contacts.size(), 100u);
  ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), {.walk_only = true}, nullptr),
            Status::kOk);
  const ContactCounters walk = query.report().counters;
  EXPECT_EQ(query.report().contacts, 0u);
  EXPECT_EQ(walk.decided_by_float32 + walk.decided_by_float64 + walk.decided_exactly, 0u);
  EXPECT_NEAR(static_cast<double>(walk.block_pairs), static_cast<double>(whole.block_pairs),
              1e-3 * static_cast<double>(whole.block_pairs));
  EXPECT_NEAR(static_cast<double>(walk.candidates), static_cast<double>(whole.candidates),
              1e-3 * static_cast<double>(whole.candidates));
  ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), {}, nullptr), Status::kOk);
  EXPECT_EQ(contacts_of(query), contacts);
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
  const Answers expected = ask(scene.assets, scene.instances, pairs, QueryMode::exact);
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  GpuStream streams[2];
  for (GpuStream& stream : streams) ASSERT_EQ(stream.create(), cudaSuccess);
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(on_gpu.assets(), streams[0].get()), Status::kOk);
  ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), {}, streams[0].get()), Status::kOk);
  int bytes = 0;
  ASSERT_EQ(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, 0), cudaSuccess);
  ASSERT_EQ(cudaFuncSetAttribute(hold, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes), cudaSuccess);
  PinnedArray<int> released;
  ASSERT_EQ(released.reserve(1), cudaSuccess);
  *released = 0;
  hold<<<processors - 1, 32, bytes, streams[1].get()>>>(released.data());
  ASSERT_EQ(cudaGetLastError(), cudaSuccess);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_EQ(query.enqueue(on_gpu.instances(), on_gpu.pairs(), {}, streams[0].get()), Status::kOk);
  const bool done = is_done_within_seconds(streams[0].get(), 20);
  *static_cast<volatile int*>(released.data()) = 1;
  if (!done && !is_done_within_seconds(streams[0].get(), 2)) {
    std::fprintf(stderr, "a query hangs where its blocks begin one after another\n");
    std::_Exit(1);  // nothing else can be done with the GPU
  }
  EXPECT_TRUE(done);
  EXPECT_EQ(contacts_of(query), expected.cpu);
  ASSERT_EQ(streams[1].wait(), cudaSuccess);
}

TEST_F(GpuContacts, MoveFromOneOwnerToAnother) {
  const BodyScene scene = pile(10, 300, 1, 14);
  const GpuScene on_gpu(scene.assets, scene.instances, {{0, 1}, {2, 3}});
  GpuContactQuery first;
  ASSERT_EQ(first.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  ASSERT_EQ(first.find_contacts(on_gpu.instances(), on_gpu.pairs(), {}, nullptr), Status::kOk);
  const auto expected = contacts_of(first);
  GpuContactQuery second = std::move(first);
  EXPECT_EQ(contacts_of(second), expected);
  ASSERT_EQ(second.find_contacts(on_gpu.instances(), on_gpu.pairs(), {}, nullptr), Status::kOk);
  EXPECT_EQ(contacts_of(second), expected);
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
  const auto device = on_gpu(pairs);
  const auto decided = on_gpu(std::vector<Decided>(pairs.size()));
  decide_all<<<(count + 63) / 64, 64>>>(device.data(), count, decided.data());
  ASSERT_EQ(cudaGetLastError(), cudaSuccess);
  ASSERT_EQ(cudaDeviceSynchronize(), cudaSuccess);
  const std::vector<Decided> found = download(decided.data(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Verdict expected = decide_exact(pairs[i]);
    ASSERT_EQ(found[i].exact, expected) << "pair " << i;
    if (found[i].float64 != Verdict::undecided) ASSERT_EQ(found[i].float64, expected) << "pair " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(, GpuTriangles, testing::ValuesIn(triangle_families()), [](const auto& family) {
  std::string name = family.param.name;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
});

}  // namespace
}  // namespace tandem
