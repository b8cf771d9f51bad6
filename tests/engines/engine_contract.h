#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "bvhbench/engines/registry.h"
#include "kernels/manifold/manifold_scene.h"

namespace tandem::test {

/// Dumb-bells in a heap over a sheet, in successive steps.
struct Pile {
  SampleAssets assets;
  std::vector<Instance> bodies;
  RandomPoses random{11};

  explicit Pile(int count = 60) {
    assets.add(sheet(8, 20));
    assets.add(joined(sphere(0.4, 3), moved(sphere(0.3, 3), 0.6f, 0, 0)));
    bodies.push_back({0, kIdentityPose});
    for (int i = 0; i < count; ++i) {
      bodies.push_back({1, after(shift(random.symmetric(2), random.symmetric(2), random.uniform(-0.3, 1.5)),
                                 any_motion(random, 0))});
    }
  }
  void step() {
    for (std::size_t i = 1; i < bodies.size(); ++i) {
      for (double& x : bodies[i].pose.translation) x += random.symmetric(0.05);
    }
  }
  /// Two of three bodies do not move.
  std::vector<std::uint8_t> idle() const {
    std::vector<std::uint8_t> idle(bodies.size());
    for (std::size_t i = 0; i < idle.size(); ++i) idle[i] = i % 3 != 1;
    return idle;
  }
};

inline ContactList found_by(Engine& engine, const Pile& pile, std::span<const std::uint8_t> idle = {}) {
  ContactList list;
  engine.find(pile.bodies, idle, list);
  return list;
}

inline bool same(const ContactList& x, const ContactList& y) {
  return x.triangles == y.triangles &&
         std::equal(x.pairs.begin(), x.pairs.end(), y.pairs.begin(), y.pairs.end(),
                    [](const ObjectPair& p, const ObjectPair& q) { return p.a == q.a && p.b == q.b; });
}

/// Why this program cannot test the engine here; empty: it can. Each program says for itself.
std::string why_not(std::string_view name);

/// Tests what every engine that simulates must do, whatever it runs on.
class EngineContract : public testing::TestWithParam<std::string_view> {
 protected:
  void SetUp() override {
    if (const std::string reason = why_not(GetParam()); !reason.empty()) GTEST_SKIP() << reason;
    engine_ = make_engine(GetParam());
    reference_ = make_engine("tandem");
    engine_->set_shapes(pile_.assets.views());
    reference_->set_shapes(pile_.assets.views());
  }

  /// Expects the same contacts as Tandem finds on the CPU, and returns them.
  ContactList expect_same(std::span<const std::uint8_t> idle = {}) {
    const ContactList list = found_by(*engine_, pile_, idle), expected = found_by(*reference_, pile_, idle);
    EXPECT_TRUE(same(list, expected)) << list.triangles.size() << " of " << expected.triangles.size();
    EXPECT_EQ(engine_->counters().contacts, list.triangles.size());
    EXPECT_EQ(engine_->counters().object_pairs, list.pairs.size());
    return list;
  }

  Pile pile_;
  std::unique_ptr<Engine> engine_, reference_;
};

TEST_P(EngineContract, FindsWhatTandemFindsOnTheCpuStepAfterStep) {
  EXPECT_EQ(engine_->name(), GetParam());
  for (int step = 0; step < 5; ++step) {
    EXPECT_GT(expect_same().triangles.size(), 500u);
    EXPECT_GT(engine_->times().sum(), 0);
    pile_.step();
  }
}

TEST_P(EngineContract, LeavesOutPairsOfIdleBodies) {
  const std::vector<std::uint8_t> idle = pile_.idle();
  const auto both_idle = [&](const ObjectPair& pair) { return idle[pair.a] != 0 && idle[pair.b] != 0; };
  const ContactList some = expect_same(idle), all = expect_same();
  EXPECT_TRUE(std::none_of(some.pairs.begin(), some.pairs.end(), both_idle));
  EXPECT_EQ(some.pairs.size() + std::count_if(all.pairs.begin(), all.pairs.end(), both_idle),
            all.pairs.size());
  const auto of_active = std::count_if(all.triangles.begin(), all.triangles.end(),
                                       [&](const auto& c) { return !both_idle(all.pairs[c.pair]); });
  EXPECT_EQ(some.triangles.size(), of_active);
  expect_same(std::vector<std::uint8_t>(pile_.bodies.size(), 1));
}

TEST_P(EngineContract, FollowsBodiesThatComeAndGo) {
  expect_same();
  pile_.bodies.resize(30);
  pile_.bodies.back().asset = 0;
  expect_same();
  pile_.bodies.resize(1);
  expect_same();
}

TEST_P(EngineContract, TellsWhichBodyIsToBlame) {
  pile_.bodies[2].pose.rotation[0][0] = 2;
  try {
    found_by(*engine_, pile_);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(std::string(GetParam()) + ": body 2: "), std::string::npos)
        << error.what();
  }
}

inline std::string name_of(const testing::TestParamInfo<std::string_view>& tested) {
  std::string name(tested.param);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

}  // namespace tandem::test
