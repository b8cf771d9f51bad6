#include "rest.h"

#include <algorithm>
#include <cmath>

#include "bvhbench/engines/registry.h"
#include "bvhbench/simulator/preparation.h"
#include "bvhbench/simulator/simulator.h"
#include "common/random_pose.h"

namespace tandem::economy {
namespace {

using namespace simulation;

void move_starts(const bench::LoadedScene& scene, double nudge, Preparation& start) {
  Random random(1);
  for (std::size_t i = 0; i < start.bodies.size(); ++i) {
    const Vector direction = random_direction(random);
    if (start.bodies[i].motion != Motion::moving) continue;
    const double length = nudge * bounds_of(scene.view(start.bodies[i].shape)).diagonal();
    start.states[i].position += length * Vector3{direction[0], direction[1], direction[2]};
  }
}

}  // namespace

Rest simulate(const std::string& path, const bench::LoadedScene& scene, const SimulationSettings& settings) {
  constexpr double kDensity = 1000;  // kg/m^3, where the scene is silent
  Preparation start = prepare_scene(path, scene, kDensity);
  if (settings.nudge > 0) move_starts(scene, settings.nudge, start);
  SimulatorOptions options;
  options.threads = settings.threads;
  options.solver.substeps = default_substeps(options.solver.method);
  const std::vector<AssetView> shapes = scene.views();
  options.solver.slop = default_slop(shapes, start.bodies);
  ExcludedPairTable excluded;
  auto engine = make_engine(settings.engine);
  engine->set_filter(scene.description.filter.view(excluded));
  Simulator simulator(start.bodies, start.states,
                      make_mesh_contact_finder(std::move(engine), shapes, settings.threads), options);
  const auto steps = static_cast<std::size_t>(std::max(1.0, std::round(settings.seconds / options.dt)));
  const std::size_t last = std::max<std::size_t>(1, steps / 10);
  Rest rest;
  for (std::size_t i = 0; i < steps; ++i) {
    const StepRecord record = simulator.step();
    rest.step_seconds += record.step_seconds / static_cast<double>(steps);
    if (i + last >= steps) rest.speed += record.speed_max / static_cast<double>(last);
  }
  for (std::size_t i = 0; i < start.bodies.size(); ++i) {
    if (start.bodies[i].motion == Motion::moving) rest.positions.push_back(simulator.states()[i].position);
  }
  return rest;
}

Spread end_distance(const Rest& a, const Rest& b) {
  std::vector<double> distances;
  for (std::size_t i = 0; i < a.positions.size(); ++i)
    distances.push_back(norm(a.positions[i] - b.positions[i]));
  return spread_of(distances);
}

}  // namespace tandem::economy
