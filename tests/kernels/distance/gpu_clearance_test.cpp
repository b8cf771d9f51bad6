// Clearance on a GPU: triangles within a distance, the CPU's to the last pair.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/asked.h"
#include "tandem/kernels/gpu_broad_phase.h"

namespace tandem {
namespace {

using test::all_pairs;
using test::AskedContacts;
using test::BodyScene;
using test::ContactAnswer;
using test::kModes;
using test::pile;
using test::RandomPoses;

GpuContactOptions within(double d, QueryMode mode = QueryMode::exact, bool first_contact_only = false) {
  GpuContactOptions options = test::gpu_options(mode, first_contact_only);
  options.within = d;
  return options;
}

ContactAnswer of_cpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs, double d,
                     QueryMode mode = QueryMode::exact) {
  ContactAnswer found = test::ask_cpu(scene, pairs, {.mode = mode, .within = d});
  EXPECT_EQ(found.status, Status::kOk);
  return found;
}

ContactAnswer of_gpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs,
                     const GpuContactOptions& options) {
  ContactAnswer found = test::ask_gpu(scene, pairs, options);
  EXPECT_EQ(found.status, Status::kOk);
  return found;
}

void expect_as_cpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs, double d, QueryMode mode) {
  const ContactAnswer gpu = of_gpu(scene, pairs, within(d, mode));
  test::expect_equal(gpu, of_cpu(scene, pairs, d, mode), mode);
  const ContactCounters& counters = gpu.counters;
  if (mode != QueryMode::boxes) {
    EXPECT_EQ(counters.candidates,
              counters.decided_by_float32 + counters.decided_by_float64 + counters.decided_exactly);
  }
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
          const ContactAnswer found = of_gpu(scene, {{0, 1}}, within(tie.distance, mode));
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
    const std::vector<Contact> all = of_cpu(scene, pairs, 0.1, mode).contacts;
    const ContactAnswer first = of_gpu(scene, pairs, within(0.1, mode, true));
    test::expect_one_of_each_pair(first.contacts, all);
    EXPECT_EQ(first.counters.contacts, first.contacts.size());
  }
}

// This scene is for tools that are too slow for larger ones.
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
  AskedContacts gpu(scene, {});
  const test::GpuBounds bounds(scene.assets);
  GpuBroadPhase broad_phase;
  test::Asked<ContactQuery> cpu;
  ASSERT_EQ(cpu.set_assets(scene.assets.views()), Status::kOk);
  for (const double d : {0.05, 0.5}) {
    ASSERT_EQ(
        broad_phase.find_pairs(gpu.scene.instances(), bounds.view(), {.sorted = true, .within = d}, nullptr),
        Status::kOk);
    ASSERT_EQ(gpu.query.find_contacts(gpu.scene.instances(), broad_phase.pairs(), within(d), nullptr),
              Status::kOk);
    ASSERT_EQ(cpu.find(scene.instances, {.within = d}), Status::kOk);
    EXPECT_EQ(broad_phase.report().found, cpu.pairs().size());
    EXPECT_EQ(gpu.contacts(), test::sorted({cpu.rows().begin(), cpu.rows().end()}));
  }
}

TEST_F(GpuClearance, ThatDoesNotFitIsAskedForAndFoundOnTheRetry) {
  RandomPoses random(6);
  const BodyScene scene = pile(40, 800, 2, 10);
  const auto pairs = all_pairs(scene.instances, false, random);
  const std::vector<Contact> expected = of_cpu(scene, pairs, 0.1).contacts;
  const GpuContactOptions options = within(0.1);
  AskedContacts gpu(scene, pairs);
  ASSERT_EQ(gpu.query.reserve({10, 100, 0}), Status::kOk);
  EXPECT_EQ(gpu.enqueue(nullptr, options), Status::kOutOfRange) << "reserved for contacts alone";
  for (const std::uint32_t room : {10u, static_cast<std::uint32_t>(pairs.size())}) {
    ASSERT_EQ(gpu.query.reserve({room, 100, 20}, options), Status::kOk);
    gpu.run(options);
    EXPECT_EQ(gpu.report().status, Status::kOk);
    EXPECT_EQ(gpu.report().complete, 0u);
    EXPECT_EQ(gpu.report().needed.pairs, pairs.size());
  }
  EXPECT_EQ(gpu.report().contacts, 100u);
  EXPECT_GT(gpu.report().needed.undecided, 20u);
  ASSERT_EQ(gpu.find(options), Status::kOk);
  EXPECT_EQ(gpu.contacts(), expected);
  gpu.run(options);
  EXPECT_EQ(gpu.report().complete, 1u);
  EXPECT_EQ(gpu.contacts(), expected);
  EXPECT_LE(gpu.query.bytes(), most_query_bytes(gpu.query.capacity(), options, scene.assets.size()));
  ASSERT_EQ(gpu.find(test::gpu_options(QueryMode::exact)), Status::kOk);
  EXPECT_EQ(gpu.contacts(), of_cpu(scene, pairs, 0).contacts) << "contacts again";
}

TEST_F(GpuClearance, IsGroupedAndSorted) {
  RandomPoses random(7);
  const BodyScene scene = pile(40, 800, 2, 11);
  const auto pairs = all_pairs(scene.instances, false, random);
  const std::vector<Contact> expected = of_cpu(scene, pairs, 0.1).contacts;
  for (const bool by_triangle : {false, true}) {
    GpuContactOptions options = within(0.1);
    options.grouped = true;
    options.sorted = by_triangle;
    AskedContacts gpu(scene, pairs);
    ASSERT_EQ(gpu.find(options), Status::kOk);
    EXPECT_EQ(gpu.contacts(), expected);
    const auto first = test::download(gpu.query.groups().first_contact, pairs.size() + 1);
    const auto contacts = gpu.stored();
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
  const std::vector<Contact> expected = of_cpu(scene, pairs, 0.05).contacts;
  test::GraphStream stream;
  AskedContacts gpu(scene, pairs, Contents::all, stream.get());
  ASSERT_EQ(gpu.find(within(0.05), stream.get()), Status::kOk);
  stream.capture([&] { return gpu.enqueue(stream.get(), within(0.05)); });
  for (int run = 0; run < 5; ++run) {
    stream.launch();
    EXPECT_EQ(gpu.report().complete, 1u);
    EXPECT_EQ(gpu.contacts(), expected);
  }
}

TEST_F(GpuClearance, RefusesWhatIsNoDistance) {
  const BodyScene scene = pile(2, 100, 0.5, 11);
  AskedContacts gpu(scene, {{0, 1}});
  for (const double d : {-1.0, std::nan(""), HUGE_VAL, 1e301})
    EXPECT_EQ(gpu.find(within(d)), Status::kBadReach);
  EXPECT_EQ(gpu.find(within(1e300)), Status::kOk);
  EXPECT_EQ(gpu.report().contacts, of_cpu(scene, {{0, 1}}, 1e300).contacts.size());
}

}  // namespace
}  // namespace tandem
