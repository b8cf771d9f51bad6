// Whole queries against all pairs of triangles, and every way to compute them against the others.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "kernels/asked.h"
#include "kernels/contact/narrow_phase.h"
#include "kernels/geometry/grid_test.h"
#include "kernels/query_scenes.h"
#include "kernels/triangle_oracle.h"
#include "tandem/kernels/world_box.h"

namespace tandem {
namespace {

using test::BodyScene;
using test::FaceContacts;
using test::found_contacts;
using test::RandomPoses;

class Scenes : public testing::TestWithParam<test::SceneFamily> {
 protected:
  /// Calls check(scene, seed) for scenes of the family until one fails.
  template <class Check>
  void for_scenes(int count, Check check) {
    for (int seed = 0; seed < count && !HasFailure(); ++seed) {
      RandomPoses random(2009 + static_cast<std::uint64_t>(seed));
      const BodyScene scene = GetParam().make(random);
      check(scene, seed);
      if (HasFailure()) std::printf("%s, seed %d:\n%s", GetParam().name, seed, text(scene).c_str());
    }
  }
};

INSTANTIATE_TEST_SUITE_P(All, Scenes, testing::ValuesIn(test::scene_families()),
                         [](const auto& test) { return std::string(test.param.name); });

/// The pairs by world boxes, which hold all posed vertices.
void expect_pairs_of_world_boxes(const BodyScene& scene, const test::Asked<ContactQuery>& query,
                                 bool selves) {
  const auto count = static_cast<std::uint32_t>(scene.instances.size());
  std::vector<WorldBox> boxes;
  for (std::uint32_t i = 0; i < count; ++i) {
    const FileHeader& header = *scene.assets.views()[scene.instances[i].asset].header;
    const Pose stored = for_stored_coordinates(scene.instances[i].pose, header.origin);
    boxes.push_back(world_box(stored, header.lower, header.upper));
    for (const auto& triangle : posed_triangles(scene, i)) {
      for (const auto& corner : triangle) {
        for (std::size_t k = 0; k < 3; ++k) {
          ASSERT_LE(boxes[i].lo[k], corner[k]);
          ASSERT_GE(boxes[i].hi[k], corner[k]);
        }
      }
    }
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> expected, found;
  for (std::uint32_t a = 0; a < count; ++a) {
    for (std::uint32_t b = selves ? a : a + 1; b < count; ++b) {
      if (a == b || overlap(boxes[a], boxes[b])) expected.emplace_back(a, b);
    }
  }
  for (const ObjectPair& pair : query.pairs()) found.emplace_back(pair.a, pair.b);
  EXPECT_EQ(found, expected);
}

void expect_sound_contacts(const BodyScene& scene, const test::Asked<ContactQuery>& query) {
  std::uint32_t last = 0;
  for (const Contact& contact : query.rows()) {
    ASSERT_GE(contact.pair, last);
    ASSERT_LT(contact.pair, query.pairs().size());
    last = contact.pair;
    const auto face = [&](std::uint32_t instance, std::uint32_t triangle) {
      const LevelView level = scene.assets.views()[scene.instances[instance].asset].level();
      EXPECT_LT(triangle, level.triangle_count);
      return level.triangles[triangle].source_face();
    };
    const ObjectPair pair = query.pairs()[contact.pair];
    EXPECT_EQ(face(pair.a, contact.triangle_a), contact.face_a);
    EXPECT_EQ(face(pair.b, contact.triangle_b), contact.face_b);
    if (pair.a == pair.b) {
      EXPECT_LT(contact.triangle_a, contact.triangle_b);
    }
  }
}

void expect_sound_counters(const test::Asked<ContactQuery>& query) {
  const ContactCounters& c = query.counters();
  EXPECT_EQ(c.object_pairs, query.pairs().size());
  EXPECT_EQ(c.contacts, query.rows().size());
  EXPECT_EQ(c.candidates, c.decided_by_float32 + c.decided_by_float64 + c.decided_exactly);
  EXPECT_GE(c.candidates, c.contacts);
  EXPECT_GE(c.block_pairs, c.object_pairs);
}

TEST_P(Scenes, HaveTheContactsOfExactArithmeticOnAllPairsOfTriangles) {
  test::Asked<ContactQuery> query;
  ContactCounters sum{};
  const int count = test::trials(250, 200);
  for_scenes(count, [&](const BodyScene& scene, int seed) {
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    ContactOptions options;
    options.self_pairs = seed % 3 == 0;
    ASSERT_EQ(query.find(scene.instances, options), Status::kOk);
    EXPECT_EQ(found_contacts(query), all_contacts(scene, options.self_pairs));
    expect_pairs_of_world_boxes(scene, query, options.self_pairs);
    expect_sound_contacts(scene, query);
    expect_sound_counters(query);
    sum.contacts += query.counters().contacts;
    sum.candidates += query.counters().candidates;
    sum.decided_by_float32 += query.counters().decided_by_float32;
    sum.decided_by_float64 += query.counters().decided_by_float64;
    sum.decided_exactly += query.counters().decided_exactly;
  });
  std::printf(
      "%-12s %d scenes: %.0f candidates, %.0f contacts; decided by float32 %.0f, float64 %.0f, exactly "
      "%.0f\n",
      GetParam().name, count, static_cast<double>(sum.candidates), static_cast<double>(sum.contacts),
      static_cast<double>(sum.decided_by_float32), static_cast<double>(sum.decided_by_float64),
      static_cast<double>(sum.decided_exactly));
  EXPECT_GT(sum.contacts, static_cast<std::uint64_t>(count));
}

/// decide_exact(), by which the test above judges, against CGAL.
TEST_P(Scenes, HaveTheContactsThatCgalFinds) {
  test::Asked<ContactQuery> query;
  for_scenes(test::trials(40, 50) / oracle_share(), [&](const BodyScene& scene, int) {
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(query.find(scene.instances), Status::kOk);
    FaceContacts expected;
    for (std::uint32_t b = 1; b < scene.instances.size(); ++b) {
      for (std::uint32_t a = 0; a < b; ++a) {
        const auto of_a = posed_triangles(scene, a), of_b = posed_triangles(scene, b);
        for (std::uint32_t i = 0; i < of_a.size(); ++i) {
          for (std::uint32_t j = 0; j < of_b.size(); ++j) {
            if (oracle_contact(test::pair_of(of_a[i], of_b[j]))) expected.push_back({a, b, i, j});
          }
        }
      }
    }
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(found_contacts(query), expected);
  });
}

TEST_P(Scenes, HaveTheirContactsAmongTheCandidates) {
  test::Asked<ContactQuery> exact, boxes;
  std::uint64_t dropped = 0;
  for_scenes(test::trials(60, 100), [&](const BodyScene& scene, int seed) {
    ContactOptions options;
    options.self_pairs = seed % 2 == 0;
    ASSERT_EQ(exact.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(boxes.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(exact.find(scene.instances, options), Status::kOk);
    options.mode = QueryMode::boxes;
    ASSERT_EQ(boxes.find(scene.instances, options), Status::kOk);
    const FaceContacts contacts = found_contacts(exact), candidates = found_contacts(boxes);
    EXPECT_TRUE(std::includes(candidates.begin(), candidates.end(), contacts.begin(), contacts.end()));
    EXPECT_EQ(std::adjacent_find(candidates.begin(), candidates.end()), candidates.end());
    // The planes of large triangles drop some of what boxes say.
    EXPECT_GE(boxes.counters().candidates, exact.counters().candidates);
    dropped += boxes.counters().candidates - exact.counters().candidates;
    EXPECT_EQ(boxes.counters().contacts, boxes.counters().candidates);
    EXPECT_GE(boxes.counters().block_pairs, exact.counters().block_pairs);
    EXPECT_EQ(boxes.counters().decided_by_float32 + boxes.counters().decided_by_float64 +
                  boxes.counters().decided_exactly,
              0u);
  });
  if (std::string(GetParam().name) == "on_ground") {
    EXPECT_GT(dropped, 0u);
  }
}

TEST_P(Scenes, HaveAFirstContactWhereTheyHaveAny) {
  test::Asked<ContactQuery> all, first;
  for_scenes(test::trials(60, 100), [&](const BodyScene& scene, int seed) {
    ContactOptions options;
    options.self_pairs = seed % 2 == 0;
    options.mode = seed % 5 == 0 ? QueryMode::boxes : QueryMode::exact;
    ASSERT_EQ(all.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(first.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(all.find(scene.instances, options), Status::kOk);
    options.first_contact_only = true;
    ASSERT_EQ(first.find(scene.instances, options), Status::kOk);
    std::vector<Contact> expected;
    for (const Contact& contact : all.rows()) {
      if (expected.empty() || expected.back().pair != contact.pair) expected.push_back(contact);
    }
    const std::vector<Contact> found(first.rows().begin(), first.rows().end());
    // Both queries find contacts in the same order, so the one that is reported is the first of all.
    EXPECT_EQ(found, expected);
    EXPECT_EQ(first.counters().contacts, expected.size());
    EXPECT_LE(first.counters().candidates, all.counters().candidates);
    if (options.mode == QueryMode::exact) expect_sound_counters(first);
  });
}

struct Answer {
  std::vector<Contact> contacts;
  ContactCounters counters;
  friend bool operator==(const Answer&, const Answer&) = default;
};

/// A sink with little room, which has to grow.
Answer run(NarrowPhase way, const PairTask& task) {
  std::vector<Contact> room(1);
  ContactSink sink;
  sink.next = room.data();
  sink.end = room.data() + room.size();
  sink.owner = &room;
  sink.grow = [](ContactSink& full) {
    auto& contacts = *static_cast<std::vector<Contact>*>(full.owner);
    const auto used = full.next - contacts.data();
    contacts.resize(contacts.size() + 3);
    full.next = contacts.data() + used;
    full.end = contacts.data() + contacts.size();
    return true;
  };
  EXPECT_TRUE(way(task, sink));
  room.resize(static_cast<std::size_t>(sink.next - room.data()));
  return {room, sink.counters};
}

PosedTree posed_tree(const BodyScene& scene, std::uint32_t instance) {
  const AssetView& asset = scene.assets.views()[scene.instances[instance].asset];
  const LevelView level = asset.level();
  const TreeExtent extent = extent_of(level.blocks[0]);
  return {level, extent, grid_of(level, extent),
          for_stored_coordinates(scene.instances[instance].pose, asset.header->origin)};
}

FaceContacts sorted_faces(const Answer& answer) {
  FaceContacts out;
  for (const Contact& c : answer.contacts) out.push_back({0, 0, c.face_a, c.face_b});
  std::sort(out.begin(), out.end());
  return out;
}

TEST_P(Scenes, GiveTheSameBitsInEveryVariant) {
  int compared = 0, out_of_frame = 0;
  for_scenes(test::trials(60, 100), [&](const BodyScene& scene, int) {
    std::vector<PosedTree> trees;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) trees.push_back(posed_tree(scene, i));
    for (const PosedTree& a : trees) {
      for (const PosedTree& b : trees) {
        PairTask task = pair_task(a, b);
        task.pair = 7;
        out_of_frame += !task.in_frame;
        if (!task.in_frame) continue;
        for (const QueryMode mode : {QueryMode::exact, QueryMode::fast, QueryMode::boxes}) {
          for (const bool first_only : {false, true}) {
            task.mode = mode;
            task.first_contact_only = first_only;
            const Answer scalar = run(narrow_phase(BlockPairVariant::scalar), task);
            for (const BlockPairVariant variant : kBlockPairVariants) {
              const NarrowPhase way = narrow_phase(variant);
              if (way == nullptr || variant == BlockPairVariant::scalar) continue;
              ++compared;
              EXPECT_EQ(run(way, task), scalar) << "variant " << static_cast<int>(variant) << ", mode "
                                                << static_cast<int>(mode) << ", first only " << first_only;
            }
            if (mode == QueryMode::exact && !first_only) {
              EXPECT_EQ(sorted_faces(run(narrow_phase_by_world_boxes, task)).size(), scalar.contacts.size());
            }
          }
        }
      }
    }
  });
  EXPECT_GT(compared + out_of_frame, 0);
}

/// Here every pair goes through narrow_phase_by_world_boxes(), which a query uses only out of range.
TEST_P(Scenes, HaveTheSameContactsByWorldBoxes) {
  for_scenes(test::trials(60, 100), [&](const BodyScene& scene, int) {
    std::vector<PosedTree> trees;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) trees.push_back(posed_tree(scene, i));
    for (std::uint32_t a = 0; a < trees.size(); ++a) {
      for (std::uint32_t b = a; b < trees.size(); ++b) {
        const PairTask task = pair_task(trees[a], trees[b]);
        FaceContacts found = sorted_faces(run(narrow_phase_by_world_boxes, task));
        for (auto& contact : found) {
          if (a == b && contact.face_a > contact.face_b) std::swap(contact.face_a, contact.face_b);
          contact.a = a;
          contact.b = b;
        }
        std::sort(found.begin(), found.end());
        EXPECT_EQ(found, all_contacts(scene, a, b));
      }
    }
  });
}

/// Far more memory and time than the scenes above: batches and stacks of all fillings.
TEST(ContactQuery, FindsAllContactsOfDenseMeshes) {
  RandomPoses random(3);
  for (int i = 0; i < test::trials(6, 20); ++i) {
    BodyScene scene;
    for (const double size : {0.6, 1.0}) {
      scene.assets.add(soup(random, static_cast<std::uint32_t>(150 + random.below(150)), size), {},
                       random.below(2) == 0 ? build::Imaginary::minimal : build::Imaginary::free);
    }
    for (std::uint32_t k = 0; k < 3; ++k) scene.instances.push_back({k % 2, any_rotation(random)});
    test::Asked<ContactQuery> query;
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    ContactOptions options;
    options.self_pairs = true;
    ASSERT_EQ(query.find(scene.instances, options), Status::kOk);
    EXPECT_EQ(found_contacts(query), all_contacts(scene, true));
    EXPECT_GT(query.rows().size(), 2000u);
  }
}

}  // namespace
}  // namespace tandem
