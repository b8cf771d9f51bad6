#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include "engine_pile.h"

namespace tandem::test {
namespace {

class GpuEngine : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    int count = 0;
    if (cudaGetDeviceCount(&count) != cudaSuccess || count == 0) GTEST_SKIP() << "no GPU";
    engine_ = make_engine(GetParam());
    reference_ = make_engine("tandem");
    engine_->set_shapes(pile_.assets.views());
    reference_->set_shapes(pile_.assets.views());
  }

  void expect_same(std::span<const std::uint8_t> idle = {}) {
    const ContactList list = found_by(*engine_, pile_, idle), expected = found_by(*reference_, pile_, idle);
    EXPECT_TRUE(same(list, expected)) << list.triangles.size() << " of " << expected.triangles.size();
    EXPECT_EQ(engine_->counters().contacts, list.triangles.size());
    EXPECT_EQ(engine_->counters().object_pairs, list.pairs.size());
  }

  Pile pile_;
  std::unique_ptr<Engine> engine_, reference_;
};

TEST_P(GpuEngine, FindsWhatTheCpuFindsStepAfterStep) {
  for (int step = 0; step < 5; ++step) {
    expect_same();
    EXPECT_GT(engine_->times().sum(), 0);
    pile_.step();
  }
}

TEST_P(GpuEngine, LeavesOutPairsOfIdleBodies) {
  expect_same(pile_.idle());
  expect_same();
  expect_same(std::vector<std::uint8_t>(pile_.bodies.size(), 1));
}

TEST_P(GpuEngine, FollowsBodiesThatComeAndGo) {
  expect_same();
  pile_.bodies.resize(30);
  pile_.bodies.back().asset = 0;
  expect_same();
  pile_.bodies.resize(1);
  expect_same();
}

TEST_P(GpuEngine, TellsWhichBodyIsToBlame) {
  pile_.bodies[2].pose.rotation[0][0] = 2;
  try {
    found_by(*engine_, pile_);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(std::string(GetParam()) + ": body 2: "), std::string::npos)
        << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(Engines, GpuEngine, testing::Values("tandem-cuda", "paper", "paper-bits"),
                         [](const auto& tested) {
                           std::string name(tested.param);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace tandem::test
