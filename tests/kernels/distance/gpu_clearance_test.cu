// Clearance on a GPU: triangles within a distance, the CPU's to the last pair.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "gpu/gpu_scene_fixture.h"
#include "tandem/kernels/gpu_broad_phase.h"

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

GpuContactOptions within(double d, QueryMode mode = QueryMode::exact, bool first_contact_only = false) {
  GpuContactOptions options = test::gpu_options(mode, first_contact_only);
  options.within = d;
  return options;
}

std::vector<Contact> contacts_of(const GpuContactQuery& query) {
  return sorted(download(query.contacts(), query.report().contacts));
}

struct Answer {
  std::vector<Contact> contacts;
  ContactCounters counters;
};

Answer of_cpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs, double d,
              QueryMode mode = QueryMode::exact) {
  ContactQuery query;
  EXPECT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(query.find_contacts(scene.instances, pairs, {.mode = mode, .within = d}), Status::kOk);
  return {sorted({query.contacts().begin(), query.contacts().end()}), query.counters()};
}

Answer of_gpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs,
              const GpuContactOptions& options) {
  const GpuScene device(scene.assets, scene.instances, pairs);
  GpuContactQuery query;
  EXPECT_EQ(query.set_assets(device.assets(), nullptr), Status::kOk);
  EXPECT_EQ(query.find_contacts(device.instances(), device.pairs(), options, nullptr), Status::kOk)
      << cudaGetErrorString(query.cuda_error());
  return {contacts_of(query), query.report().counters};
}

void expect_as_cpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs, double d, QueryMode mode) {
  const Answer cpu = of_cpu(scene, pairs, d, mode), gpu = of_gpu(scene, pairs, within(d, mode));
  ASSERT_EQ(gpu.contacts.size(), cpu.contacts.size());
  EXPECT_EQ(gpu.contacts, cpu.contacts);
  const ContactCounters &of_gpu = gpu.counters, &of_cpu = cpu.counters;
  if (mode != QueryMode::boxes) {
    EXPECT_EQ(of_gpu.candidates,
              of_gpu.decided_by_float32 + of_gpu.decided_by_float64 + of_gpu.decided_exactly);
  }
  if (mode == QueryMode::exact) return;  // other blocks are walked, and operations fused
  EXPECT_EQ(of_gpu.block_pairs, of_cpu.block_pairs);
  EXPECT_EQ(of_gpu.candidates, of_cpu.candidates);
  EXPECT_EQ(of_gpu.decided_by_float32, of_cpu.decided_by_float32);
}

class GpuClearance : public test::GpuTest {};

class GpuClearanceOf : public test::GpuTestOf<test::SceneFamily> {};

TEST_P(GpuClearanceOf, IsTheCpus) {
  std::size_t beyond_contacts = 0;
  for (int trial = 0; trial < test::trials(25, 20) && !HasFailure(); ++trial) {
    RandomPoses random(1868 + static_cast<std::uint64_t>(trial));
    const BodyScene scene = GetParam().make(random);
    const double d = test::any_distance(random, scene);
    const std::vector<ObjectPair> pairs = all_pairs(scene.instances, trial % 2 == 0, random);
    for (const QueryMode mode : kModes) {
      SCOPED_TRACE(testing::Message()
                   << "trial " << trial << " mode " << static_cast<int>(mode) << " d " << d << '\n'
                   << test::text(scene));
      expect_as_cpu(scene, pairs, d, mode);
    }
    beyond_contacts += of_cpu(scene, pairs, d).contacts.size() - of_cpu(scene, pairs, 0).contacts.size();
  }
  EXPECT_GT(beyond_contacts, 0u);
}

INSTANTIATE_TEST_SUITE_P(, GpuClearanceOf, testing::ValuesIn(test::scene_families()),
                         [](const auto& family) { return std::string(family.param.name); });

Instance at(double x, double y, double z) {
  Pose pose = kIdentityPose;
  pose.translation[0] = x, pose.translation[1] = y, pose.translation[2] = z;
  return {0, pose};
}

// Every decision at a corner, edge or face of a cube is one of whole numbers.
TEST_F(GpuClearance, CountsATieAndNothingBeyond) {
  struct Tie {
    double distance, x, y, z;
  };
  for (const Tie& tie :
       {Tie{0.25, 1.25, 0, 0}, Tie{0.25, 1.25, 0.5, 0.125}, Tie{5, 4, 5, 0}, Tie{7, 3, 4, 7}}) {
    for (const int cells : {1, 4}) {
      for (const double far : {0.0, 1e9}) {
        BodyScene scene;
        scene.assets.add(test::cube(0.5f, cells));
        scene.instances = {at(far, 0, far), at(far + tie.x, tie.y, far + tie.z)};
        for (const QueryMode mode : {QueryMode::exact, QueryMode::fast}) {
          expect_as_cpu(scene, {{0, 1}}, tie.distance, mode);
          const Answer found = of_gpu(scene, {{0, 1}}, within(tie.distance, mode));
          EXPECT_FALSE(found.contacts.empty());
          EXPECT_GT(found.counters.decided_exactly, 0u);
          const double less = std::nextafter(tie.distance, 0.0);
          EXPECT_TRUE(of_gpu(scene, {{0, 1}}, within(less, mode)).contacts.empty());
        }
      }
    }
  }
}

// Coordinates beside 1e-60 take wider numbers than a thread has room for; with 1e-300 the widest.
TEST_F(GpuClearance, DecidesTiesOfCoordinatesOfAllSizes) {
  for (const double small : {1e-30, 1e-60, 1e-300}) {
    BodyScene scene;
    scene.assets.add(test::cube(0.5f, 2));
    scene.instances = {at(0, 0, 0), at(1.25, small, 0), at(0.5, 3, small), at(1.25, 1 + 0.25, -small)};
    RandomPoses random(3);
    const auto pairs = all_pairs(scene.instances, false, random);
    for (const double d : {0.25, std::nextafter(0.25, 0.0), 2.0, small}) {
      for (const QueryMode mode : {QueryMode::exact, QueryMode::fast}) expect_as_cpu(scene, pairs, d, mode);
    }
    EXPECT_GT(of_gpu(scene, pairs, within(0.25)).counters.decided_exactly, 100u);
  }
}

TEST_F(GpuClearance, OfAPileIsTheCpusAtEveryDistance) {
  RandomPoses random(2);
  const BodyScene scene = pile(60, 1000, 3, 7);
  const auto pairs = all_pairs(scene.instances, false, random);
  std::size_t last = 0;
  for (const double d : {1e-30, 1e-4, 0.01, 0.1}) {
    for (const QueryMode mode : kModes) expect_as_cpu(scene, pairs, d, mode);
    const std::size_t found = of_cpu(scene, pairs, d).contacts.size();
    EXPECT_GT(found, last);
    last = found;
  }
}

TEST_F(GpuClearance, FarAwayIsTheCpus) {
  RandomPoses random(4);
  for (const double far : {1e4, 1e7, 1e12, 1e52}) {
    BodyScene scene = pile(20, far > 1e10 ? 40 : 1000, 1, 8);
    for (Instance& instance : scene.instances) instance.pose.translation[1] += far;
    const auto pairs = all_pairs(scene.instances, false, random);
    for (const QueryMode mode : kModes) expect_as_cpu(scene, pairs, 0.1, mode);
  }
  // A distance that float32 cannot take.
  BodyScene scene;
  scene.assets.add(test::cube(0.5f, 2));
  for (int i = 0; i < 4; ++i) scene.instances.push_back({0, random.pose({1, 1, 10, 0, 4})});
  const auto pairs = all_pairs(scene.instances, true, random);
  for (const QueryMode mode : kModes) expect_as_cpu(scene, pairs, 1e20, mode);
}

TEST_F(GpuClearance, FirstOnesAreOfThePairsThatHaveAny) {
  RandomPoses random(5);
  const BodyScene scene = pile(60, 800, 3, 9);
  const auto pairs = all_pairs(scene.instances, false, random);
  for (const QueryMode mode : kModes) {
    const Answer all = of_cpu(scene, pairs, 0.1, mode), first = of_gpu(scene, pairs, within(0.1, mode, true));
    std::map<std::uint32_t, int> wanted, found;
    for (const Contact& contact : all.contacts) wanted[contact.pair] = 1;
    for (const Contact& contact : first.contacts) {
      ++found[contact.pair];
      EXPECT_TRUE(std::binary_search(all.contacts.begin(), all.contacts.end(), contact, test::comes_before));
    }
    EXPECT_EQ(found, wanted);
    EXPECT_EQ(first.counters.contacts, wanted.size());
  }
}

// For tools that are too slow for more.
TEST_F(GpuClearance, OfASmallSceneInEveryMode) {
  RandomPoses random(15);
  BodyScene scene;
  test::Mesh triangle;
  triangle.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  scene.assets.add(triangle);
  scene.assets.add(test::soup(random, 60, 0.1));
  scene.instances = {at(0, 0, 0), at(1e-60, 0, 0.25)};  // a tie that takes wide numbers
  for (int i = 0; i < 4; ++i) scene.instances.push_back({1, random.pose({1, 1, 0.3, 0, 4})});
  EXPECT_GT(of_gpu(scene, {{0, 1}}, within(0.25)).counters.decided_exactly, 0u);
  const auto pairs = all_pairs(scene.instances, true, random);
  for (const QueryMode mode : kModes) expect_as_cpu(scene, pairs, 0.25, mode);
}

TEST_F(GpuClearance, OfPairsThatABroadPhaseFinds) {
  const BodyScene scene = pile(150, 300, 8, 12);
  const GpuScene device(scene.assets, scene.instances, {});
  std::vector<AssetBounds> bounds;
  for (const AssetView& asset : scene.assets.views()) bounds.push_back(asset_bounds(*asset.header));
  const auto device_bounds = on_gpu(bounds);
  GpuBroadPhase broad_phase;
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(device.assets(), nullptr), Status::kOk);
  ContactQuery cpu;
  ASSERT_EQ(cpu.set_assets(scene.assets.views()), Status::kOk);
  for (const double d : {0.05, 0.5}) {
    ASSERT_EQ(broad_phase.find_pairs(device.instances(), {device_bounds.data(), 2},
                                     {.sorted = true, .within = d}, nullptr),
              Status::kOk);
    ASSERT_EQ(query.find_contacts(device.instances(), broad_phase.pairs(), within(d), nullptr), Status::kOk);
    ASSERT_EQ(cpu.find_contacts(scene.instances, {.within = d}), Status::kOk);
    EXPECT_EQ(broad_phase.report().found, cpu.pairs().size());
    EXPECT_EQ(contacts_of(query), sorted({cpu.contacts().begin(), cpu.contacts().end()}));
  }
}

TEST_F(GpuClearance, ThatDoesNotFitIsAskedForAndFoundOnTheRetry) {
  RandomPoses random(6);
  const BodyScene scene = pile(40, 800, 2, 10);
  const auto pairs = all_pairs(scene.instances, false, random);
  const GpuScene device(scene.assets, scene.instances, pairs);
  const Answer expected = of_cpu(scene, pairs, 0.1);
  const GpuContactOptions options = within(0.1);
  const auto enqueue = [&](GpuContactQuery& query) {
    EXPECT_EQ(query.enqueue(device.instances(), device.pairs(), options, nullptr), Status::kOk);
    EXPECT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  };
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(device.assets(), nullptr), Status::kOk);
  ASSERT_EQ(query.reserve({10, 100, 0}), Status::kOk);
  EXPECT_EQ(query.enqueue(device.instances(), device.pairs(), options, nullptr), Status::kOutOfRange)
      << "reserved for contacts alone";
  for (const std::uint32_t room : {10u, static_cast<std::uint32_t>(pairs.size())}) {
    ASSERT_EQ(query.reserve({room, 100, 20}, options), Status::kOk);
    enqueue(query);
    EXPECT_EQ(query.report().status, Status::kOk);
    EXPECT_EQ(query.report().complete, 0u);
    EXPECT_EQ(query.report().needed.pairs, pairs.size());
  }
  EXPECT_EQ(query.report().contacts, 100u);
  EXPECT_GT(query.report().needed.undecided, 20u);
  ASSERT_EQ(query.find_contacts(device.instances(), device.pairs(), options, nullptr), Status::kOk);
  EXPECT_EQ(contacts_of(query), expected.contacts);
  enqueue(query);
  EXPECT_EQ(query.report().complete, 1u);
  EXPECT_EQ(contacts_of(query), expected.contacts);
  EXPECT_LE(query.bytes(), most_query_bytes(query.capacity(), options, scene.assets.size()));
  ASSERT_EQ(
      query.find_contacts(device.instances(), device.pairs(), test::gpu_options(QueryMode::exact), nullptr),
      Status::kOk);
  EXPECT_EQ(contacts_of(query), of_cpu(scene, pairs, 0).contacts) << "contacts again";
}

TEST_F(GpuClearance, IsGroupedAndSorted) {
  RandomPoses random(7);
  const BodyScene scene = pile(40, 800, 2, 11);
  const auto pairs = all_pairs(scene.instances, false, random);
  const GpuScene device(scene.assets, scene.instances, pairs);
  const Answer expected = of_cpu(scene, pairs, 0.1);
  for (const bool by_triangle : {false, true}) {
    GpuContactOptions options = within(0.1);
    options.grouped = true;
    options.sorted = by_triangle;
    GpuContactQuery query;
    ASSERT_EQ(query.set_assets(device.assets(), nullptr), Status::kOk);
    ASSERT_EQ(query.find_contacts(device.instances(), device.pairs(), options, nullptr), Status::kOk);
    EXPECT_EQ(contacts_of(query), expected.contacts);
    const auto first = download(query.groups().first_contact, pairs.size() + 1);
    const auto contacts = download(query.contacts(), query.report().contacts);
    EXPECT_EQ(first.back(), contacts.size());
    for (std::uint32_t pair = 0; pair < pairs.size(); ++pair) {
      for (std::uint32_t i = first[pair]; i < first[pair + 1]; ++i) ASSERT_EQ(contacts[i].pair, pair);
    }
    const auto in_order = [](const Contact& x, const Contact& y) {
      return std::tie(x.pair, x.face_a, x.face_b) < std::tie(y.pair, y.face_a, y.face_b);
    };
    EXPECT_TRUE(!by_triangle || std::is_sorted(contacts.begin(), contacts.end(), in_order));
  }
}

TEST_F(GpuClearance, IsTheSameOnEveryRunOfAGraph) {
  RandomPoses random(13);
  const BodyScene scene = pile(60, 800, 3, 13);
  const auto pairs = all_pairs(scene.instances, false, random);
  const Answer expected = of_cpu(scene, pairs, 0.05);
  const GpuScene device(scene.assets, scene.instances, pairs);
  GpuContactQuery query;
  GpuStream stream;
  GpuGraph graph;
  ASSERT_EQ(stream.create(), cudaSuccess);
  ASSERT_EQ(query.set_assets(device.assets(), stream.get()), Status::kOk);
  ASSERT_EQ(query.find_contacts(device.instances(), device.pairs(), within(0.05), stream.get()), Status::kOk);
  const auto enqueue = [&] {
    EXPECT_EQ(query.enqueue(device.instances(), device.pairs(), within(0.05), stream.get()), Status::kOk);
  };
  ASSERT_EQ(graph.capture(stream.get(), enqueue), cudaSuccess);
  for (int run = 0; run < 5; ++run) {
    ASSERT_EQ(graph.launch(stream.get()), cudaSuccess);
    ASSERT_EQ(stream.wait(), cudaSuccess);
    EXPECT_EQ(query.report().complete, 1u);
    EXPECT_EQ(contacts_of(query), expected.contacts);
  }
}

TEST_F(GpuClearance, RefusesWhatIsNoDistance) {
  const BodyScene scene = pile(2, 100, 0.5, 11);
  const GpuScene device(scene.assets, scene.instances, {{0, 1}});
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(device.assets(), nullptr), Status::kOk);
  for (const double d : {-1.0, std::nan(""), HUGE_VAL, 1e301}) {
    EXPECT_EQ(query.find_contacts(device.instances(), device.pairs(), within(d), nullptr),
              Status::kOutOfRange);
  }
  EXPECT_EQ(query.find_contacts(device.instances(), device.pairs(), within(1e300), nullptr), Status::kOk);
  EXPECT_EQ(query.report().contacts, of_cpu(scene, {{0, 1}}, 1e300).contacts.size());
}

}  // namespace
}  // namespace tandem
