// Clearance: triangles within a distance of each other, against all pairs of triangles, and every way to
// compute them against the others.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

#include "kernels/asked.h"
#include "kernels/contact/contact_query_fixture.h"
#include "kernels/contact/narrow_phase.h"
#include "kernels/geometry/grid_test.h"
#include "kernels/geometry/triangle_distance.h"
#include "tandem/kernels/distance_query.h"

namespace tandem {
namespace {

using test::any_distance;
using test::FaceContacts;
using test::PosedTriangle;

bool are_within(const PosedTriangle& a, const PosedTriangle& b, double d) {
  const TrianglePair pair = test::pair_of(a, b);
  const DistanceInterval found = triangle_distance(pair, {0, 1e-12}).interval;
  if (found.lower > d || found.upper <= d) return found.upper <= d;
  return exact::are_within(pair, d);
}

FaceContacts all_within(const BodyScene& scene, double d, bool selves) {
  std::vector<std::vector<PosedTriangle>> posed;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) posed.push_back(posed_triangles(scene, i));
  FaceContacts out;
  for (std::uint32_t a = 0; a < posed.size(); ++a) {
    for (std::uint32_t b = selves ? a : a + 1; b < posed.size(); ++b) {
      for (std::uint32_t i = 0; i < posed[a].size(); ++i) {
        for (std::uint32_t j = a == b ? i + 1 : 0; j < posed[b].size(); ++j) {
          if (are_within(posed[a][i], posed[b][j], d)) out.push_back({a, b, i, j});
        }
      }
    }
  }
  return out;
}

class ClearanceScenes : public testing::TestWithParam<test::SceneFamily> {
 protected:
  template <class Check>
  void for_scenes(int count, Check check) {
    for (int seed = 0; seed < count && !HasFailure(); ++seed) {
      RandomPoses random(1868 + static_cast<std::uint64_t>(seed));
      const BodyScene scene = GetParam().make(random);
      const double d = any_distance(random, scene);
      check(scene, d, seed);
      if (HasFailure()) std::printf("%s, seed %d, d %a:\n%s", GetParam().name, seed, d, text(scene).c_str());
    }
  }
};

INSTANTIATE_TEST_SUITE_P(All, ClearanceScenes, testing::ValuesIn(test::scene_families()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(ClearanceScenes, HaveThePairsOfExactArithmeticOnAllTriangles) {
  test::Asked<ContactQuery> query;
  std::uint64_t beyond_contacts = 0;
  for_scenes(test::trials(30, 20), [&](const BodyScene& scene, double d, int seed) {
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    ContactOptions options;
    options.self_pairs = seed % 3 == 0;
    options.within = d;
    EXPECT_EQ(query.scene.set_threads(1 + static_cast<std::uint32_t>(seed % 2)), Status::kOk);
    ASSERT_EQ(query.find(scene.instances, options), Status::kOk);
    EXPECT_EQ(found_contacts(query), all_within(scene, d, options.self_pairs)) << d;
    const ContactCounters& c = query.counters();
    EXPECT_EQ(c.candidates, c.decided_by_float32 + c.decided_by_float64 + c.decided_exactly);
    const std::size_t within = query.rows().size();
    options.within = 0;
    ASSERT_EQ(query.find(scene.instances, options), Status::kOk);
    beyond_contacts += within - query.rows().size();
  });
  EXPECT_GT(beyond_contacts, 0u);
}

TEST_P(ClearanceScenes, HaveAFirstPairWhereTheyHaveAny) {
  test::Asked<ContactQuery> all, first;
  for_scenes(test::trials(30, 20), [&](const BodyScene& scene, double d, int) {
    ASSERT_EQ(all.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(first.set_assets(scene.assets.views()), Status::kOk);
    ContactOptions options;
    options.within = d;
    ASSERT_EQ(all.find(scene.instances, options), Status::kOk);
    options.first_contact_only = true;
    ASSERT_EQ(first.find(scene.instances, options), Status::kOk);
    // Which pair comes first is unspecified.
    std::set<std::uint32_t> expected, found;
    const std::vector<Contact> within = contacts_of(all);
    for (const Contact& contact : within) expected.insert(contact.pair);
    for (const Contact& contact : first.rows()) {
      EXPECT_TRUE(found.insert(contact.pair).second);
      EXPECT_NE(std::find(within.begin(), within.end(), contact), within.end());
    }
    EXPECT_EQ(found, expected);
  });
}

PosedTree posed_tree(const BodyScene& scene, std::uint32_t instance) {
  const AssetView& asset = scene.assets.views()[scene.instances[instance].asset];
  const LevelView level = asset.level();
  return {level, extent_of(level.blocks[0]), 0,
          for_stored_coordinates(scene.instances[instance].pose, asset.header->origin)};
}

struct Answer {
  std::vector<Contact> contacts;
  ContactCounters counters;
};

Answer run(NarrowPhase way, const PairTask& task) {
  std::vector<Contact> room(1 << 16);
  ContactSink sink;
  sink.next = room.data();
  sink.end = room.data() + room.size();
  sink.grow = [](ContactSink&) { return false; };
  EXPECT_TRUE(way(task, sink));
  room.resize(static_cast<std::size_t>(sink.next - room.data()));
  return {room, sink.counters};
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> sorted_triangles(const Answer& answer) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> out;
  for (const Contact& contact : answer.contacts) out.emplace_back(contact.triangle_a, contact.triangle_b);
  std::sort(out.begin(), out.end());
  return out;
}

TEST_P(ClearanceScenes, GiveTheSameBitsInEveryVariant) {
  for_scenes(test::trials(20, 20), [&](const BodyScene& scene, double d, int seed) {
    std::vector<PosedTree> trees;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) trees.push_back(posed_tree(scene, i));
    for (const PosedTree& a : trees) {
      for (const PosedTree& b : trees) {
        PairTask task = pair_task(a, b, d);
        task.mode = seed % 4 == 3 ? QueryMode::boxes : QueryMode::exact;
        if (!task.in_frame) continue;
        const Answer scalar = run(narrow_phase(BlockPairVariant::scalar), task);
        for (const BlockPairVariant variant : kBlockPairVariants) {
          const NarrowPhase way = narrow_phase(variant);
          if (way == nullptr) continue;
          const Answer answer = run(way, task);
          EXPECT_EQ(answer.contacts, scalar.contacts) << static_cast<int>(variant);
          EXPECT_EQ(answer.counters, scalar.counters) << static_cast<int>(variant);
        }
        if (task.mode == QueryMode::exact) {
          EXPECT_EQ(sorted_triangles(run(narrow_phase_by_world_boxes, task)), sorted_triangles(scalar));
        }
      }
    }
  });
}

TEST(Clearance, CountsATieAndNothingBeyond) {
  BodyScene scene = row_of_cubes(3);
  for (int i = 0; i < 3; ++i) scene.instances[i].pose.translation[0] = 1.25 * i;
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(query.find(scene.instances, {.within = 0.25}), Status::kOk);
  // The faces of two squares, all of them within the gap, and the others' that share an edge with them.
  EXPECT_EQ(found_contacts(query), all_within(scene, 0.25, false));
  EXPECT_FALSE(query.rows().empty());
  EXPECT_GT(query.counters().decided_exactly, 0u);
  ASSERT_EQ(query.find(scene.instances, {.within = std::nextafter(0.25, 0)}), Status::kOk);
  EXPECT_TRUE(query.rows().empty());
  ASSERT_EQ(query.find(scene.instances, {.within = 1.49}), Status::kOk);
  EXPECT_EQ(query.pairs().size(), 2u);
  ASSERT_EQ(query.find(scene.instances, {.within = 1.5}), Status::kOk);
  EXPECT_EQ(query.pairs().size(), 3u);  // their world boxes are 1.5 apart
}

TEST(Clearance, TiesAtPythagoreanDistances) {
  BodyScene scene = row_of_cubes(2);
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  scene.instances[1].pose = at(4, 5, 0);  // edges 3 and 4 apart
  ASSERT_EQ(query.find(scene.instances, {.within = 5}), Status::kOk);
  EXPECT_EQ(found_contacts(query), all_within(scene, 5, false));
  EXPECT_FALSE(query.rows().empty());
  ASSERT_EQ(query.find(scene.instances, {.within = std::nextafter(5, 0)}), Status::kOk);
  EXPECT_TRUE(query.rows().empty());
  scene.instances[1].pose = at(3, 4, 7);  // corners 2, 3 and 6 apart
  ASSERT_EQ(query.find(scene.instances, {.within = 7}), Status::kOk);
  EXPECT_EQ(found_contacts(query), all_within(scene, 7, false));
  EXPECT_FALSE(query.rows().empty());
  ASSERT_EQ(query.find(scene.instances, {.within = std::nextafter(7, 0)}), Status::kOk);
  EXPECT_TRUE(query.rows().empty());
}

// Bodies that face each other across a corner: boxes that are widened by the distance along each axis meet
// where the triangles in them are not within it.
TEST(Clearance, TheFirstPairIsFoundAmongFewAtAnyDistance) {
  BodyScene scene;
  scene.assets.add(test::cube(1, 12));  // 1,728 triangles
  scene.instances = {{0, kIdentityPose}, {0, at(32, 32, 32)}};
  const double distance = 30 * std::sqrt(3.0);
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  for (const double part : {0.75, 0.99, 1 - 1e-9, 1 - 1e-15, 1 + 1e-15, 1 + 1e-9, 1.01, 1.5}) {
    ASSERT_EQ(query.find(scene.instances, {.first_contact_only = true, .within = part * distance}),
              Status::kOk);
    EXPECT_EQ(query.rows().size(), part > 1 ? 1u : 0u) << part;
    const ContactCounters& c = query.counters();
    EXPECT_LT(c.candidates, 5000u) << part;  // all: 2,985,984
    EXPECT_LT(c.block_pairs, 1000u) << part;
    if (part < 1) {
      EXPECT_EQ(c.candidates, c.decided_by_float32 + c.decided_by_float64 + c.decided_exactly);
    }
  }
  // A corner that is 3, 6 and 2 from the other, exactly.
  scene.instances[1].pose = at(5, 8, 4);
  for (const double within : {std::nextafter(7, 0), 7.0}) {
    ASSERT_EQ(query.find(scene.instances, {.first_contact_only = true, .within = within}), Status::kOk);
    EXPECT_EQ(query.rows().size(), within == 7 ? 1u : 0u);
    EXPECT_LT(query.counters().candidates, 5000u);
  }
}

// Pairs in which the walk for all gives up find a contact where the distance says so.
TEST(Clearance, FirstPairsOfManyTriangles) {
  RandomPoses random(12);
  BodyScene scene;
  scene.assets.add(test::soup(random, 1500, 0.1));
  scene.assets.add(test::cube(0.75f, 10));
  for (int i = 0; i < 24; ++i) {
    Pose pose = any_rotation(random);
    for (double& x : pose.translation) x = random.symmetric(2.5);
    scene.instances.push_back({static_cast<std::uint32_t>(i % 2), pose});
  }
  test::Asked<DistanceQuery> distances;
  test::Asked<ContactQuery> first;
  ASSERT_EQ(distances.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(first.set_assets(scene.assets.views()), Status::kOk);
  for (const double within : {0.05, 0.4, 1.0, 2.0, 3.0}) {
    ASSERT_EQ(distances.find(scene.instances, {.reach = within}), Status::kOk);
    ASSERT_EQ(first.find(scene.instances, {.first_contact_only = true, .within = within}), Status::kOk);
    ASSERT_EQ(first.pairs().size(), distances.pairs().size());
    std::size_t next = 0;
    for (std::uint32_t i = 0; i < distances.pairs().size(); ++i) {
      const bool found = next < first.rows().size() && first.rows()[next].pair == i;
      EXPECT_EQ(found, distances.rows()[i].upper <= within) << within << " " << i;
      if (!found) continue;
      const Contact& contact = first.rows()[next++];
      const std::uint32_t a = first.pairs()[i].a, b = first.pairs()[i].b;
      EXPECT_TRUE(are_within(posed_triangles(scene, a)[contact.face_a],
                             posed_triangles(scene, b)[contact.face_b], within));
    }
    EXPECT_EQ(next, first.rows().size());
  }
}

TEST(Clearance, KeptInstancesAreFoundWithinAnyDistance) {
  const BodyScene scene = crowd(5, 80);
  std::vector<Motion> motion(scene.instances.size(), Motion::moving);
  for (std::size_t i = 0; i < motion.size(); i += 2) motion[i] = Motion::fixed;
  test::Asked<ContactQuery> kept, anew;
  for (auto* query : {&kept, &anew}) ASSERT_EQ(query->set_assets(scene.assets.views()), Status::kOk);
  kept.filter.motion = motion.data();
  std::vector<ObjectPair> not_both_fixed;
  for (std::uint32_t b = 0; b < motion.size(); ++b) {
    for (std::uint32_t a = 0; a < b; ++a) {
      if (a % 2 != 0 || b % 2 != 0) not_both_fixed.push_back({a, b});
    }
  }
  for (const double d : {0.0, 0.1, 0.5}) {
    ASSERT_EQ(kept.find(scene.instances, {.within = d}), Status::kOk);
    ASSERT_EQ(anew.find(scene.instances, not_both_fixed, {.within = d}), Status::kOk);
    EXPECT_EQ(found_contacts(kept), found_contacts(anew)) << d;
  }
}

}  // namespace
}  // namespace tandem
