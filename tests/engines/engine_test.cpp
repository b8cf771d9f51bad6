#include <cmath>

#include "engine_contract.h"
#include "kernels/asked.h"

namespace tandem::test {

// On a GPU engine_gpu_test asks.
std::string why_not(std::string_view name) {
  if (name == "tandem-cuda" || name.starts_with("paper")) return "asked of a GPU by engine_gpu_test";
  return is_built_in(name) ? "" : std::string(name) + " is not built in";
}

INSTANTIATE_TEST_SUITE_P(OnCpu, EngineContract, testing::ValuesIn(engine_names()), name_of);

namespace {

TEST(Engines, FindThePairsThatContactQueryFindsStepAfterStep) {
  Pile pile;
  const auto engine = make_engine("tandem");
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
    EXPECT_TRUE(same(list, expected)) << list.triangles.size() << " of " << expected.triangles.size();
    pile.step();
  }
}

std::string message_of(std::string_view name, const Question& question = ContactOptions()) {
  try {
    make_engine(name, question);
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
    EXPECT_EQ(message_of(name, ContactOptions{.mode = QueryMode::fast}),
              "the engine " + std::string(name) + " has no fast mode");
  }
}

TEST(Engines, RefuseAQuestionThatTheyDoNotAnswer) {
  for (const std::string_view name : {"paper", "fcl", "embree", "bullet"}) {
    if (!is_built_in(name)) continue;
    EXPECT_EQ(message_of(name, DistanceOptions()),
              "the engine " + std::string(name) + " does not answer this question");
  }
  EXPECT_EQ(message_of("cgal", DistanceOptions()), "");
  EXPECT_THROW(make_engine("tandem")->time_distances({}), std::logic_error);
}

TEST(Engines, FindTheSameDistances) {
  Pile pile(3);
  for (std::size_t i = 1; i < pile.bodies.size(); ++i)
    pile.bodies[i].pose.translation[0] = 3 * static_cast<double>(i);
  const std::vector<ObjectPair> pairs = {{1, 2}, {2, 3}, {1, 3}};
  std::vector<double> expected, distances;
  for (const auto& engine : make_peers(DistanceOptions())) {
    engine->set_shapes(pile.assets.views());
    engine->update(pile.bodies);
    engine->find_distances(pairs, distances);
    if (expected.empty()) expected = distances;
    ASSERT_EQ(distances.size(), pairs.size()) << engine->label();
    for (std::size_t i = 0; i < pairs.size(); ++i)
      EXPECT_NEAR(distances[i], expected[i], 1e-5) << engine->label();
  }
}

TEST(Engines, FindTheSameClosestPointsAndHits) {
  const Pile pile(20);
  RandomPoses random(5);
  std::vector<std::array<double, 3>> from, along;
  for (int i = 0; i < 500; ++i) {
    auto &p = from.emplace_back(), &d = along.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = static_cast<double>(static_cast<float>(random.symmetric(4)));
      d[k] = static_cast<double>(static_cast<float>(random.symmetric(1)));
    }
  }
  std::vector<double> expected[2];
  for (const auto& engine : make_peers(ProbeOptions())) {
    std::vector<double> distances, times;
    engine->set_shapes(pile.assets.views());
    engine->update(pile.bodies);
    engine->find_closest(from, distances);
    engine->find_hits(from, along, times);
    if (expected[0].empty()) expected[0] = distances, expected[1] = times;
    ASSERT_EQ(distances.size(), from.size()) << engine->label();
    ASSERT_EQ(times.size(), from.size()) << engine->label();
    std::size_t hits = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      EXPECT_NEAR(distances[i], expected[0][i], 1e-5) << engine->label();
      const bool is_same =
          times[i] == expected[1][i] || std::abs(times[i] - expected[1][i]) < 1e-4 * times[i];
      EXPECT_TRUE(is_same) << engine->label() << ' ' << times[i] << ' ' << expected[1][i];
      hits += times[i] < HUGE_VAL;
    }
    EXPECT_GT(hits, 50u);
  }
  EXPECT_EQ(message_of("fcl", ProbeOptions()).empty(), false);
  std::vector<double> none;
  EXPECT_THROW(make_engine("tandem")->find_closest({}, none), std::logic_error);
}

TEST(Engines, FindImpactsOfTheGivenPairsAsOfThoseThatTheyFind) {
  const Pile pile(20);
  const std::vector<RigidMotion> motion(pile.bodies.size(), RigidMotion{{0, 0, -1}, {0, 0, 0}, {0, 0, 0}});
  const auto engine = make_engine("tandem", ImpactOptions());
  engine->set_shapes(pile.assets.views());
  engine->set_motion(motion, 0.5);
  engine->update(pile.bodies);
  const TimedImpacts found = engine->time_impacts({});
  const TimedImpacts again = engine->time_impacts({.given = &found.pairs, .repeats = 3});
  EXPECT_GT(found.pairs.size(), 20u);
  EXPECT_EQ(again.whole.size(), 3u);
  std::vector<double> times;
  engine->find_impacts(found.pairs, times);
  ASSERT_EQ(times.size(), again.rows.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_EQ(again.rows[i].t_safe, found.rows[i].t_safe);
    EXPECT_EQ(std::isinf(times[i]), found.rows[i].status == ImpactStatus::none);
  }
}

TEST(Engines, FindTheSameWithThreads) {
  const Pile pile;
  ContactList lists[2];
  for (const std::uint32_t threads : {1u, 4u}) {
    const auto engine = make_engine("tandem");
    engine->set_threads(threads);
    engine->set_shapes(pile.assets.views());
    engine->find(pile.bodies, {}, lists[threads == 1 ? 0 : 1]);
  }
  EXPECT_TRUE(same(lists[0], lists[1]));
}

}  // namespace
}  // namespace tandem::test
