// Contacts of an instance with itself that leave out neighbours, against all pairs of triangles and a search
// over the edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <vector>

#include "contact_query_fixture.h"
#include "kernels/cloth_scenes.h"
#include "kernels/contact/narrow_phase.h"
#include "kernels/geometry/clearance.h"
#include "kernels/geometry/grid_test.h"

namespace tandem {
namespace {

using test::FaceContacts;
using test::NeighbourReference;
using test::PosedTriangle;
using test::Surface;

constexpr std::uint32_t kRings[] = {0, 1, 2, 3, 5, kMostRings};

class SelfContacts : public testing::TestWithParam<Surface> {
 protected:
  SelfContacts() : reference_(GetParam().mesh) {
    scene_.assets.add(GetParam().mesh);
    RandomPoses random(6);
    scene_.instances = {{0, kIdentityPose}, {0, any_rotation(random)}};
    scene_.instances[1].pose.translation[0] = 0.3;
    EXPECT_EQ(query_.set_assets(scene_.assets.views()), Status::kOk);
  }

  void ask(const ContactOptions& options) {
    ASSERT_EQ(query_.find(scene_.instances, options), Status::kOk);
    const ContactCounters& c = query_.counters();
    EXPECT_EQ(c.contacts, query_.rows().size());
    if (options.first_contact_only && options.within > 0) return;  // candidates may be left undecided
    if (options.mode == QueryMode::boxes)
      EXPECT_EQ(c.candidates, c.contacts);
    else
      EXPECT_EQ(c.candidates, c.decided_by_float32 + c.decided_by_float64 + c.decided_exactly);
  }

  FaceContacts expected(const FaceContacts& all, std::uint32_t rings) const {
    return without_neighbours(all, reference_, rings);
  }

  /// All pairs within a distance, by exact arithmetic.
  FaceContacts all_within(double distance) const {
    std::vector<PosedTriangle> posed[2] = {posed_triangles(scene_, 0), posed_triangles(scene_, 1)};
    FaceContacts out;
    for (std::uint32_t a = 0; a < 2; ++a) {
      for (std::uint32_t b = a; b < 2; ++b) {
        for (std::uint32_t i = 0; i < posed[a].size(); ++i) {
          for (std::uint32_t j = a == b ? i + 1 : 0; j < posed[b].size(); ++j) {
            const TrianglePair pair = test::pair_of(posed[a][i], posed[b][j]);
            if (decide_exact(pair) == Verdict::contact || exact::are_within(pair, distance))
              out.push_back({a, b, i, j});
          }
        }
      }
    }
    return out;
  }

  NeighbourReference reference_;
  BodyScene scene_;
  test::Asked<ContactQuery> query_;
};

INSTANTIATE_TEST_SUITE_P(All, SelfContacts, testing::ValuesIn(test::surfaces_that_meet_themselves()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(SelfContacts, AreThoseOfExactArithmeticLessNeighbours) {
  const FaceContacts all = all_contacts(scene_, true);
  for (const std::uint32_t rings : kRings) {
    for (const QueryMode mode : {QueryMode::exact, QueryMode::boxes}) {
      ContactOptions options = {.mode = mode, .self_pairs = true};
      ask(options);
      const FaceContacts with_neighbours = found_contacts(query_);
      if (mode == QueryMode::exact) {
        EXPECT_EQ(with_neighbours, all);
      }
      options.leave_out_rings = rings;
      for (std::uint32_t threads = 1; threads <= 4; ++threads) {
        ASSERT_EQ(query_.scene.set_threads(threads), Status::kOk);
        ask(options);
        EXPECT_EQ(found_contacts(query_), expected(with_neighbours, rings)) << rings << " rings";
      }
    }
  }
}

/// Mode fast finds what it finds with neighbours, less these.
TEST_P(SelfContacts, OfModeFastLeaveOutTheSame) {
  ContactOptions options = {.mode = QueryMode::fast, .self_pairs = true};
  ask(options);
  const FaceContacts all = found_contacts(query_);
  for (const std::uint32_t rings : kRings) {
    options.leave_out_rings = rings;
    ask(options);
    EXPECT_EQ(found_contacts(query_), expected(all, rings)) << rings << " rings";
  }
}

TEST_P(SelfContacts, WithinADistanceLeaveOutTheSame) {
  for (const double distance : {0.01, 0.25, 0.7}) {
    const FaceContacts all = all_within(distance);
    for (const std::uint32_t rings : kRings) {
      ask({.self_pairs = true, .within = distance, .leave_out_rings = rings});
      EXPECT_EQ(found_contacts(query_), expected(all, rings)) << distance << ", " << rings << " rings";
    }
  }
}

TEST_P(SelfContacts, HaveAFirstOneThatIsNotLeftOut) {
  for (const double distance : {0.0, 0.25}) {
    for (const std::uint32_t rings : kRings) {
      ContactOptions options = {.self_pairs = true, .within = distance, .leave_out_rings = rings};
      ask(options);
      const std::vector<Contact> all = contacts_of(query_);
      std::set<std::uint32_t> pairs, found;
      for (const Contact& contact : all) pairs.insert(contact.pair);
      options.first_contact_only = true;
      ask(options);
      for (const Contact& contact : query_.rows()) {
        EXPECT_TRUE(found.insert(contact.pair).second);
        EXPECT_NE(std::find(all.begin(), all.end(), contact), all.end());
      }
      EXPECT_EQ(found, pairs) << distance << ", " << rings << " rings";
    }
  }
}

TEST_P(SelfContacts, OfGivenPairsLeaveOutTheSame) {
  const FaceContacts all = all_contacts(scene_, true);
  const std::vector<ObjectPair> pairs = {{0, 1}, {1, 1}, {0, 0}};
  for (const std::uint32_t rings : kRings) {
    ASSERT_EQ(query_.find(scene_.instances, pairs, {.leave_out_rings = rings}), Status::kOk);
    FaceContacts found = found_contacts(query_);
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected(all, rings)) << rings << " rings";
  }
}

/// Far away float32 takes no pair, so that all is walked by world boxes.
TEST_P(SelfContacts, AreTheSameFarAway) {
  scene_.instances.resize(1);
  scene_.instances[0].pose.translation[1] = 1e15;
  const FaceContacts all = all_contacts(scene_, true);
  for (const std::uint32_t rings : kRings) {
    ask({.self_pairs = true, .leave_out_rings = rings});
    EXPECT_EQ(found_contacts(query_), expected(all, rings)) << rings << " rings";
  }
}

struct Answer {
  std::vector<Contact> contacts;
  ContactCounters counters;
  friend bool operator==(const Answer&, const Answer&) = default;
};

Answer run(NarrowPhase way, const PairTask& task) {
  std::vector<Contact> room(100000);
  ContactSink sink;
  sink.next = room.data();
  sink.end = room.data() + room.size();
  sink.grow = [](ContactSink&) { return false; };
  EXPECT_TRUE(way(task, sink));
  room.resize(static_cast<std::size_t>(sink.next - room.data()));
  return {room, sink.counters};
}

TEST_P(SelfContacts, AreTheSameBitsInEveryVariant) {
  const AssetView& asset = scene_.assets.views()[0];
  const LevelView level = asset.level();
  const TreeExtent extent = extent_of(level.blocks[0]);
  const PosedTree tree = {level, extent, grid_of(level, extent),
                          for_stored_coordinates(scene_.instances[1].pose, asset.header->origin)};
  const Neighbourhood neighbours = {level.topology, nullptr, nullptr};
  for (const double distance : {0.0, 0.25}) {
    PairTask task = pair_task(tree, tree, distance);
    ASSERT_TRUE(task.in_frame);
    task.neighbours = &neighbours;
    const Answer scalar = run(narrow_phase_without_neighbours(BlockPairVariant::scalar), task);
    for (const BlockPairVariant variant : kBlockPairVariants) {
      const NarrowPhase way = narrow_phase_without_neighbours(variant);
      if (way == nullptr) continue;
      EXPECT_EQ(run(way, task), scalar) << static_cast<int>(variant);
    }
    EXPECT_EQ(run(narrow_phase_by_world_boxes, task).contacts.size(), scalar.contacts.size());
    task.neighbours = nullptr;
    const Answer all = run(narrow_phase(BlockPairVariant::scalar), task);
    for (const BlockPairVariant variant : kBlockPairVariants) {
      const NarrowPhase way = narrow_phase_without_neighbours(variant);
      if (way == nullptr) continue;
      EXPECT_EQ(run(way, task), all) << static_cast<int>(variant);
    }
  }
}

/// Two sheets in one file.
struct TwoSheets {
  test::Mesh mesh;
  test::Bytes file;
  AssetView view;
  TwoSheets() : mesh(sheets()), file(test::make_file(mesh)), view(file.check().asset) {}

  static test::Mesh sheets() {
    test::Mesh mesh = test::folded_sheet(4, 4, 0, 0);
    const std::size_t count = mesh.triangles.size();
    for (std::size_t i = 0; i < count; ++i) {
      const auto triangle = mesh.triangles[i];
      mesh.add(mesh.points[triangle[0]], mesh.points[triangle[1]], mesh.points[triangle[2]]);
    }
    return mesh;
  }
};

/// A body that bends keeps its topology: what lies at one place may be two vertices.
TEST(Neighbours, AreNotMadeByLyingAtOnePlace) {
  TwoSheets two;
  const LevelView level = two.view.level();
  const auto half = static_cast<std::uint32_t>(two.mesh.triangles.size() / 2);
  // The second sheet gets vertices of its own, where those of the first lie.
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    if (level.triangles[t].source_face() < half) continue;
    for (std::uint32_t& vertex : two.file.topology()[t].vertex) vertex += level.vertex_count;
  }
  two.file.level().vertex_count = 2 * level.vertex_count;
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets({&two.view, 1}), Status::kOk);
  const test::Mesh sheet = test::folded_sheet(4, 4, 0, 0);
  const NeighbourReference in_sheet(sheet);
  BodyScene scene;
  scene.assets.add(two.mesh);
  scene.instances = {{0, kIdentityPose}};
  const FaceContacts all = all_contacts(scene, true);
  for (const std::uint32_t rings : kRings) {
    FaceContacts expected;
    for (const test::FaceContact& contact : all) {
      const bool same = (contact.face_a < half) == (contact.face_b < half);
      if (!same || in_sheet.rings_between(contact.face_a % half, contact.face_b % half) > rings)
        expected.push_back(contact);
    }
    ASSERT_EQ(query.find(scene.instances, {.self_pairs = true, .leave_out_rings = rings}), Status::kOk);
    EXPECT_EQ(found_contacts(query), expected) << rings << " rings";
  }
}

/// Another number of rings, and other assets, take other lists.
TEST(Neighbours, FollowTheRingsAndTheAssetsThatAreAskedAbout) {
  const std::vector<Surface> surfaces = test::surfaces_that_meet_themselves();
  test::Asked<ContactQuery> query;
  for (const std::size_t chosen : {1u, 5u, 3u}) {
    BodyScene scene;
    scene.assets.add(surfaces[2].mesh);
    scene.assets.add(surfaces[chosen].mesh);
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    // Asset 1 comes first, then both: lists are made when a body of theirs is first asked about.
    for (const std::vector<Instance>& bodies :
         {std::vector<Instance>{{1, kIdentityPose}},
          std::vector<Instance>{{0, at(90, 0, 0)}, {1, kIdentityPose}, {0, at(0, 90, 0)}}}) {
      scene.instances = bodies;
      for (const std::uint32_t rings : {3u, 2u, 2u, 4u, 1u}) {
        FaceContacts expected;
        for (std::uint32_t i = 0; i < bodies.size(); ++i) {
          const NeighbourReference reference(scene.assets.mesh(bodies[i].asset));
          const FaceContacts own = without_neighbours(all_contacts(scene, i, i), reference, rings);
          expected.insert(expected.end(), own.begin(), own.end());
        }
        ASSERT_EQ(query.find(bodies, {.self_pairs = true, .leave_out_rings = rings}), Status::kOk);
        EXPECT_EQ(found_contacts(query), expected) << rings << " rings";
      }
    }
  }
}

TEST(Neighbours, NeedTopologyOfTheBodiesThatMeetThemselvesOnly) {
  const TwoSheets with;
  const build::Tree tree = build::build_tree(with.mesh.geometry());
  std::vector<std::uint32_t> face(with.mesh.triangles.size());
  std::iota(face.begin(), face.end(), 0u);
  const build::AssetLevel bare{with.mesh.geometry(), face, &tree, {}};
  const build::SourcePart part = {"all", "", 0, face.size()};
  const test::Bytes file(test::assembled({&bare, 1}, face.size(), {&part, 1}));
  const AssetView views[] = {with.view, file.check().asset};
  ASSERT_EQ(views[1].level().topology, nullptr);
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(views), Status::kOk);
  const std::vector<Instance> bodies = {{0, kIdentityPose}, {1, kIdentityPose}};
  EXPECT_EQ(query.find(bodies, {.self_pairs = true, .leave_out_rings = 1}), Status::kNoTopology);
  EXPECT_EQ(query.where(), 1u);
  EXPECT_TRUE(query.rows().empty());
  EXPECT_EQ(query.find(bodies, {.self_pairs = true}), Status::kOk);
  EXPECT_EQ(query.find(bodies, {.leave_out_rings = 1}), Status::kOk);
  EXPECT_FALSE(query.rows().empty());
  const std::vector<ObjectPair> pairs = {{0, 0}, {0, 1}};
  EXPECT_EQ(query.find(bodies, pairs, {.leave_out_rings = 2}), Status::kOk);
}

TEST(Neighbours, OfMoreRingsThanTheMostAreRefused) {
  TwoSheets two;
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets({&two.view, 1}), Status::kOk);
  const std::vector<Instance> bodies = {{0, kIdentityPose}};
  EXPECT_EQ(query.find(bodies, {.leave_out_rings = kMostRings + 1}), Status::kBadOption);
  EXPECT_EQ(query.find(bodies, {.leave_out_rings = ~0u}), Status::kBadOption);
  EXPECT_EQ(query.find(bodies, {.self_pairs = true, .leave_out_rings = kMostRings}), Status::kOk);
}

}  // namespace
}  // namespace tandem
