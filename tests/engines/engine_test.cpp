#include <gtest/gtest.h>

#include <algorithm>

#include "engine_pile.h"
#include "kernels/asked.h"

namespace tandem::test {
namespace {

class Engine : public testing::TestWithParam<std::string_view> {
 protected:
  // Not here, or on a GPU that is not here: engine_gpu_test has those.
  void SetUp() override {
    const std::string_view name = GetParam();
    if (name == "tandem-cuda" || name.starts_with("paper"))
      GTEST_SKIP() << "asked of a GPU by engine_gpu_test";
    if (!is_built_in(name)) GTEST_SKIP() << name << " is not built in";
  }
};

TEST_P(Engine, FindsThePairsThatContactQueryFindsStepAfterStep) {
  Pile pile;
  const auto engine = make_engine(GetParam());
  EXPECT_EQ(engine->name(), GetParam());
  engine->set_shapes(pile.assets.views());
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(pile.assets.views()), Status::kOk);
  for (int step = 0; step < 3; ++step) {
    const ContactList list = found_by(*engine, pile);
    ASSERT_EQ(query.find(pile.bodies), Status::kOk);
    ContactList expected;
    expected.pairs.assign(query.pairs().begin(), query.pairs().end());
    for (const Contact& c : query.rows()) {
      expected.triangles.push_back({c.pair, c.triangle_a, c.triangle_b});
    }
    std::sort(expected.triangles.begin(), expected.triangles.end());
    EXPECT_GT(list.triangles.size(), 500u);
    EXPECT_TRUE(same(list, expected)) << list.triangles.size() << " of " << expected.triangles.size();
    EXPECT_EQ(engine->counters().contacts, list.triangles.size());
    EXPECT_EQ(engine->counters().object_pairs, list.pairs.size());
    EXPECT_GT(engine->times().sum(), 0);
    pile.step();
  }
}

TEST_P(Engine, LeavesOutPairsOfIdleBodies) {
  Pile pile;
  const auto engine = make_engine(GetParam());
  engine->set_shapes(pile.assets.views());
  const ContactList all = found_by(*engine, pile);
  const std::vector<std::uint8_t> idle = pile.idle();
  const auto both_idle = [&](const ObjectPair& pair) { return idle[pair.a] != 0 && idle[pair.b] != 0; };
  const ContactList some = found_by(*engine, pile, idle);
  EXPECT_TRUE(std::none_of(some.pairs.begin(), some.pairs.end(), both_idle));
  EXPECT_EQ(some.pairs.size() + std::count_if(all.pairs.begin(), all.pairs.end(), both_idle),
            all.pairs.size());
  const auto of_active = std::count_if(all.triangles.begin(), all.triangles.end(),
                                       [&](const auto& c) { return !both_idle(all.pairs[c.pair]); });
  EXPECT_EQ(some.triangles.size(), of_active);
}

TEST_P(Engine, FollowsBodiesThatComeAndGo) {
  Pile pile;
  const auto engine = make_engine(GetParam());
  engine->set_shapes(pile.assets.views());
  found_by(*engine, pile);
  pile.bodies.resize(30);
  pile.bodies.back().asset = 0;
  const auto fresh = make_engine("tandem");
  fresh->set_shapes(pile.assets.views());
  EXPECT_TRUE(same(found_by(*engine, pile), found_by(*fresh, pile)));
}

INSTANTIATE_TEST_SUITE_P(Engines, Engine, testing::ValuesIn(engine_names()), [](const auto& tested) {
  std::string name(tested.param);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

std::string message_of(std::string_view name, const ContactOptions& options = {}) {
  try {
    make_engine(name, options);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

TEST(Engines, ThatAreNotThereSaySoByName) {
  EXPECT_EQ(message_of("rapid"),
            "no engine rapid: there are tandem, tandem-cuda, paper, paper-bits, fcl, embree, embree-refit");
  for (const std::string_view name : engine_names()) {
    if (is_built_in(name)) continue;
    EXPECT_NE(message_of(name).find("the engine " + std::string(name) + " is not built in: "),
              std::string::npos);
  }
}

TEST(Engines, RefuseAModeTheyDoNotHave) {
  for (const std::string_view name : {"fcl", "embree", "embree-refit"}) {
    if (!is_built_in(name)) continue;
    EXPECT_EQ(message_of(name, {.mode = QueryMode::fast}),
              "the engine " + std::string(name) + " has no fast mode");
  }
}

TEST(Engines, TellWhichBodyIsToBlame) {
  Pile pile(3);
  pile.bodies[2].pose.rotation[0][0] = 2;
  const auto engine = make_engine("tandem");
  engine->set_shapes(pile.assets.views());
  ContactList list;
  try {
    engine->find(pile.bodies, {}, list);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("tandem: body 2: "), std::string::npos) << error.what();
  }
}

TEST(Engines, FindTheSameWithThreads) {
  const Pile pile;
  ContactList lists[2];
  for (const std::uint32_t threads : {1u, 4u}) {
    const auto engine = make_engine("tandem", {.threads = threads});
    engine->set_shapes(pile.assets.views());
    engine->find(pile.bodies, {}, lists[threads == 1 ? 0 : 1]);
  }
  EXPECT_TRUE(same(lists[0], lists[1]));
}

}  // namespace
}  // namespace tandem::test
