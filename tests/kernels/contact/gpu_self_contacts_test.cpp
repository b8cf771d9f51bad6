// Contacts of an instance with itself that leave out neighbours, on the GPU: those of the CPU.
#include <gtest/gtest.h>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/cloth_scenes.h"
#include "tandem/kernels/gpu_scene.h"

namespace tandem {
namespace {

using test::AskedContacts;
using test::BodyScene;
using test::ContactAnswer;

constexpr std::uint32_t kRings[] = {0, 1, 2, 3, kMostRings};

GpuContactOptions leaving_out(std::uint32_t rings, QueryMode mode = QueryMode::exact) {
  GpuContactOptions options = test::gpu_options(mode);
  options.leave_out_rings = rings;
  return options;
}

/// Instances of a surface, which meet each other too.
BodyScene scene_of(const test::Surface& surface) {
  BodyScene scene;
  scene.assets.add(surface.mesh);
  test::RandomPoses random(6);
  scene.instances = {{0, kIdentityPose}, {0, any_rotation(random)}, {0, any_rotation(random)}};
  scene.instances[1].pose.translation[0] = 0.3;
  scene.instances[2].pose.translation[1] = 1e15;  // by world boxes
  return scene;
}

const std::vector<ObjectPair> kPairs = {{0, 0}, {0, 1}, {1, 1}, {2, 2}};

class GpuSelfContacts : public test::GpuTestOf<test::Surface> {};

INSTANTIATE_TEST_SUITE_P(All, GpuSelfContacts, testing::ValuesIn(test::surfaces_that_meet_themselves()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(GpuSelfContacts, AreTheCpus) {
  const BodyScene scene = scene_of(GetParam());
  for (const std::uint32_t rings : kRings) {
    for (const QueryMode mode : test::kModes) {
      const ContactAnswer cpu = ask_cpu(scene, kPairs, {.mode = mode, .leave_out_rings = rings});
      const ContactAnswer gpu = ask_gpu(scene, kPairs, leaving_out(rings, mode));
      expect_equal(gpu, cpu, mode);
      EXPECT_GE(gpu.counters.candidates, gpu.counters.contacts);
    }
  }
}

TEST_P(GpuSelfContacts, WithinADistanceAreTheCpus) {
  const BodyScene scene = scene_of(GetParam());
  for (const double distance : {0.01, 0.25}) {
    for (const std::uint32_t rings : kRings) {
      for (const QueryMode mode : test::kModes) {
        GpuContactOptions options = leaving_out(rings, mode);
        options.within = distance;
        const ContactAnswer cpu =
            ask_cpu(scene, kPairs, {.mode = mode, .within = distance, .leave_out_rings = rings});
        EXPECT_EQ(ask_gpu(scene, kPairs, options).contacts, cpu.contacts) << distance << ", " << rings;
      }
    }
  }
}

TEST_P(GpuSelfContacts, HaveAFirstOneThatIsNotLeftOut) {
  const BodyScene scene = scene_of(GetParam());
  for (const std::uint32_t rings : kRings) {
    GpuContactOptions options = leaving_out(rings);
    options.first_contact_only = true;
    test::expect_one_of_each_pair(ask_gpu(scene, kPairs, options).contacts,
                                  ask_cpu(scene, kPairs, {.leave_out_rings = rings}).contacts);
  }
}

/// Contacts of instances with themselves, whose triangles may come in either order.
std::vector<Contact> lower_first(std::vector<Contact> contacts) {
  for (Contact& contact : contacts) {
    if (contact.triangle_a <= contact.triangle_b) continue;
    std::swap(contact.triangle_a, contact.triangle_b);
    std::swap(contact.face_a, contact.face_b);
  }
  return test::sorted(contacts);
}

/// One query keeps its lists from call to call, and makes others for another number of rings.
TEST_P(GpuSelfContacts, FollowTheRingsOfTheCall) {
  const BodyScene scene = scene_of(GetParam());
  AskedContacts gpu(scene, kPairs);
  for (const std::uint32_t rings : {3u, 3u, 1u, 0u, 3u, 2u}) {
    GpuContactOptions options = leaving_out(rings);
    options.sorted = options.grouped = true;
    ASSERT_EQ(gpu.find(options), Status::kOk);
    EXPECT_EQ(lower_first(gpu.contacts()),
              lower_first(ask_cpu(scene, kPairs, {.leave_out_rings = rings}).contacts))
        << rings;
  }
}

class GpuNeighbours : public test::GpuTest {};

/// Several assets, of which the first meets no one; and other assets after these.
TEST_F(GpuNeighbours, FollowTheAssets) {
  const std::vector<test::Surface> surfaces = test::surfaces_that_meet_themselves();
  GpuContactQuery query;
  for (const std::size_t first : {1u, 4u, 2u}) {
    BodyScene scene;
    for (const std::size_t i : {first, std::size_t{5}, first + 1}) scene.assets.add(surfaces[i].mesh);
    scene.instances = {{1, kIdentityPose}, {2, kIdentityPose}, {1, kIdentityPose}};
    const std::vector<ObjectPair> pairs = {{0, 0}, {1, 1}, {0, 1}, {2, 2}};
    const test::GpuScene on_gpu(scene.assets, scene.instances, pairs);
    ASSERT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kOk);
    for (const std::uint32_t rings : kRings) {
      ASSERT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), leaving_out(rings), nullptr),
                Status::kOk);
      EXPECT_EQ(test::sorted(test::download(query.contacts(), query.report().contacts)),
                ask_cpu(scene, pairs, {.leave_out_rings = rings}).contacts);
    }
  }
}

/// A sheet of many triangles in folds: warps share its walk.
TEST_F(GpuNeighbours, OfALargeSheetAreLeftOut) {
  BodyScene scene;
  scene.assets.add(test::folded_sheet(400, 60, 9, 0.25f));
  scene.instances = {{0, kIdentityPose}};
  const std::vector<ObjectPair> pairs = {{0, 0}};
  for (const std::uint32_t rings : {1u, 2u}) {
    for (const double distance : {0.0, 0.3}) {
      GpuContactOptions options = leaving_out(rings);
      options.within = distance;
      const ContactAnswer cpu = ask_cpu(scene, pairs, {.within = distance, .leave_out_rings = rings});
      const ContactAnswer gpu = ask_gpu(scene, pairs, options);
      EXPECT_EQ(gpu.contacts, cpu.contacts);
      EXPECT_EQ(gpu.contacts.empty(), distance == 0);
    }
  }
}

TEST_F(GpuNeighbours, AreLeftOutInAGraph) {
  const BodyScene scene = scene_of(test::surfaces_that_meet_themselves()[1]);
  const std::vector<Contact> expected = ask_cpu(scene, kPairs, {.leave_out_rings = 2}).contacts;
  test::GraphStream stream;
  AskedContacts gpu(scene, kPairs, Contents::all, stream.get());
  const GpuContactOptions options = leaving_out(2);
  ASSERT_EQ(gpu.find(options, stream.get()), Status::kOk);
  stream.capture([&] { return gpu.enqueue(stream.get(), options); });
  stream.launch();
  EXPECT_EQ(gpu.contacts(), expected);
}

TEST_F(GpuNeighbours, AreRefusedWhereTheyWereNotReserved) {
  const BodyScene scene = scene_of(test::surfaces_that_meet_themselves()[1]);
  AskedContacts gpu(scene, kPairs);
  ASSERT_EQ(gpu.query.reserve({4, 1000, 1000}, leaving_out(2)), Status::kOk);
  EXPECT_EQ(gpu.enqueue(nullptr, leaving_out(1)), Status::kOutOfRange);
  EXPECT_EQ(gpu.enqueue(nullptr, leaving_out(2)), Status::kOk);
  EXPECT_EQ(gpu.enqueue(nullptr, leaving_out(kMostRings + 1)), Status::kBadOption);
  EXPECT_EQ(gpu.find(leaving_out(kMostRings + 1)), Status::kBadOption);
}

TEST_F(GpuNeighbours, NeedTopologyOfTheBodiesThatMeetThemselvesOnly) {
  const BodyScene scene = scene_of(test::surfaces_that_meet_themselves()[1]);
  const test::GpuScene on_gpu(scene.assets, scene.instances, kPairs),
      apart(scene.assets, scene.instances, {{0, 1}});
  std::vector<GpuAsset> assets(on_gpu.assets().begin(), on_gpu.assets().end());
  assets.push_back(assets[0]);
  assets[0].tree.topology = nullptr;
  GpuContactQuery query;
  ASSERT_EQ(query.set_assets(assets, nullptr), Status::kOk);
  for (const std::uint32_t rings : {1u, 2u}) {
    EXPECT_EQ(query.find_contacts(on_gpu.instances(), on_gpu.pairs(), leaving_out(rings), nullptr),
              Status::kNoTopology);
    EXPECT_EQ(query.report().where, 0u);
    EXPECT_EQ(query.report().contacts, 0u);
    EXPECT_EQ(query.find_contacts(apart.instances(), apart.pairs(), leaving_out(rings), nullptr),
              Status::kOk);
    EXPECT_GT(query.report().contacts, 0u);
  }
}

/// A scene on a GPU takes the option as one on the CPU does.
TEST_F(GpuNeighbours, AreLeftOutByScenes) {
  const BodyScene scene = scene_of(test::surfaces_that_meet_themselves()[2]);
  Scene cpu;
  tandem::GpuScene gpu;
  ContactQuery of_cpu, of_gpu;
  ASSERT_EQ(cpu.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(gpu.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(cpu.place(scene.instances), Status::kOk);
  ASSERT_EQ(gpu.place(scene.instances), Status::kOk);
  for (const std::uint32_t rings : kRings) {
    const ContactOptions options = {.self_pairs = true, .leave_out_rings = rings};
    ASSERT_EQ(of_cpu.find(cpu, options), Status::kOk);
    ASSERT_EQ(of_gpu.find(gpu, options), Status::kOk);
    EXPECT_EQ(lower_first({of_gpu.rows().begin(), of_gpu.rows().end()}),
              lower_first({of_cpu.rows().begin(), of_cpu.rows().end()}));
  }
}

}  // namespace
}  // namespace tandem
