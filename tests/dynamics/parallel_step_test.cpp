#include "dynamics/parallel/parallel_simulation.h"

#include <gtest/gtest.h>

#include <cstring>

#include "dynamics/falling_bodies.h"
#include "dynamics/host_questions.h"
#include "dynamics/parallel/host_executor.h"

namespace tandem::test {
namespace {

using namespace dynamics;

bool same_bytes(const BodyState& p, const BodyState& q) {
  return std::memcmp(&p, &q, sizeof p) == 0;
}

// The same bodies by Simulation and by a parallel simulation on threads of the CPU.
class BothWays {
 public:
  BothWays(const FallingBodies& of, const SleepOptions& sleep, std::uint32_t threads = 1)
      : threads_(threads),
        executor_(threads_),
        questions_(of.assets.views()),
        parallel(executor_, questions_) {
    const SimulationOptions options = options_of(of, sleep);
    SimulationParts parts;
    parts.contacts = make_scene_contacts(of.assets.views(), 1);
    parts.ahead = std::make_unique<ContactsAhead>(of.assets.views(), 1);
    simulation = std::make_unique<Simulation>(of.properties, of.states, std::move(parts), options);
    const std::vector<double> inner = inner_radii(of.assets.views());
    std::vector<AssetBox> boxes;
    for (const AssetView& view : of.assets.views())
      boxes.push_back(asset_box(view.header->lower, view.header->upper, view.header->origin));
    EXPECT_EQ(parallel.set_bodies({of.properties, of.states, inner, boxes},
                                  {options.gravity, options.solver, options.sleep}),
              Status::kOk);
  }

  static SimulationOptions options_of(const FallingBodies& of, const SleepOptions& sleep) {
    SimulationOptions options;
    options.solver.kind = SolverKind::soft;
    options.solver.slop = default_slop(of.assets.views(), of.properties);
    options.solver.rolling_resistance = 16 * options.solver.slop;
    options.sleep = sleep;
    return options;
  }

  std::span<const BodyState> states() const { return {parallel.arrays().start, parallel.bodies()}; }

 private:
  Threads threads_;
  HostExecutor executor_;
  HostQuestions questions_;

 public:
  std::unique_ptr<Simulation> simulation;
  ParallelSimulation<HostExecutor, HostQuestions> parallel;
};

TEST(ParallelStep, IsTheStepOfASimulation) {
  const FallingBodies bodies(24);
  BothWays both(bodies, {});
  std::uint32_t middle = 0, ahead = 0, missed = 0, contacts = 0;
  for (int step = 0; step < 240; ++step) {
    const StepRecord record = both.simulation->step();
    ASSERT_EQ(both.parallel.step(1.0 / 60), Status::kOk) << step;
    const StepCounts& counts = both.parallel.counts();
    middle += counts.middle, ahead += counts.approaches, missed += counts.missed;
    contacts += static_cast<std::uint32_t>(record.contacts);
    for (std::size_t i = 0; i < bodies.states.size(); ++i)
      ASSERT_TRUE(same_bytes(both.states()[i], both.simulation->states()[i]))
          << "step " << step << " body " << i;
  }
  EXPECT_GT(middle, 100u);
  EXPECT_GT(ahead, 100u);
  EXPECT_GT(contacts, 1000u);
  EXPECT_GT(missed, 0u);
}

TEST(ParallelStep, SleepsAndWakesAsASimulationDoes) {
  const FallingBodies bodies(12, 5);
  BothWays both(bodies, {.enabled = true, .speed = 0.05, .delay = 0.3}, 3);
  std::uint64_t slept = 0;
  for (int step = 0; step < 400; ++step) {
    slept += both.simulation->step().sleeping;
    ASSERT_EQ(both.parallel.step(1.0 / 60), Status::kOk) << step;
    for (std::uint32_t i = 0; i < bodies.states.size(); ++i) {
      ASSERT_TRUE(same_bytes(both.states()[i], both.simulation->states()[i]))
          << "step " << step << " body " << i;
      ASSERT_EQ(both.parallel.arrays().group[i] != Sleep::kAwake, both.simulation->sleeps(i))
          << step << " " << i;
    }
  }
  EXPECT_GT(slept, 100u);
}

}  // namespace
}  // namespace tandem::test
