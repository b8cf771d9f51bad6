#include "simulator.h"

#include <algorithm>

#include "common/stopwatch.h"

namespace tandem::simulation {
namespace {

void take(StepRecord& record, const FinderReport& report) {
  record.update_seconds = report.engine.update;
  record.broad_phase_seconds = report.engine.broad_phase;
  record.traversal_seconds = report.engine.traversal;
  record.triangle_test_seconds = report.engine.triangle_tests;
  record.transfer_seconds = report.engine.transfer;
  record.contact_seconds = report.generation;
  record.object_pairs = report.counters.object_pairs;
  record.kept_pairs = report.kept_pairs;
  record.block_pairs = report.counters.block_pairs;
  record.candidates = report.counters.candidates;
  record.triangle_pairs = report.counters.contacts;
  record.segments = report.contacts.counters.segments;
  record.patches = report.contacts.counters.manifolds;
  record.open_curves = report.contacts.counters.open_curves;
  record.contact_area = report.contacts.area;
}

}  // namespace

Simulator::Simulator(std::vector<BodyProperties> bodies, std::vector<BodyState> states,
                     std::unique_ptr<ContactFinder> contacts, const SimulatorOptions& options,
                     std::unique_ptr<ContinuousMotion> continuous)
    : bodies_(std::move(bodies)),
      acting_(bodies_),
      states_(std::move(states)),
      finder_(std::move(contacts)),
      continuous_(std::move(continuous)),
      options_(options),
      arena_(static_cast<int>(options.threads)),
      solver_(make_step_solver(options.solver)) {
  sleep_.start(bodies_.size());
}

StepRecord Simulator::step() {
  return arena_.execute([&] { return step_in_arena(); });
}

StepRecord Simulator::step_in_arena() {
  Stopwatch step, phase;
  StepRecord record;
  find_contacts(record);
  phase.lap();
  solve(record);
  sleep();
  record.solver_seconds = phase.lap();
  record.time = static_cast<double>(++step_) * options_.dt;
  take_measures(record);
  record.step_seconds = step.lap();
  return record;
}

void Simulator::find_contacts(StepRecord& record) {
  constexpr double kFall = 2;  // times what gravity lets a body fall in a step
  const std::vector<std::uint8_t> idle = this->idle();
  const std::vector<ObjectPair> remembered = cache_.pairs();
  const std::vector<ContactPoint>& found = finder_->find(poses(), idle, {remembered, options_.solver.slop});
  take(record, finder_->report());
  Stopwatch stopwatch;
  const double gap = kFall * options_.gravity.norm() * options_.dt * options_.dt;
  cache_.update(found, finder_->kept(), bodies_, states_, idle, gap);
  record.contact_seconds += stopwatch.lap();
  record.contacts = cache_.contacts().size();
  for (const ContactPoint& contact : cache_.contacts()) {
    const double depth = std::max(contact.depth, 0.0);
    record.penetration_max = std::max(record.penetration_max, depth);
    record.penetration_mean += depth / static_cast<double>(record.contacts);
  }
}

void Simulator::solve(StepRecord& record) {
  const std::span<const ContactPoint> contacts = cache_.contacts();
  islands_ = find_islands(acting_, contacts);
  std::vector<ContactImpulse> impulses(contacts.size());
  if (options_.solver.warm_start) impulses = cache_.impulses();
  const std::vector<BodyState> before = continuous_ ? states_ : std::vector<BodyState>();
  solver_->step({acting_, contacts, islands_, options_.dt, options_.gravity, step_, cache_.is_cold()},
                states_, impulses);
  if (continuous_) continuous_->limit(acting_, before, states_, options_.solver.slop);
  cache_.remember(impulses);
  record.residual_max = solver_->statistics().residual;
  record.residual_rms = solver_->statistics().residual_rms;
  record.islands = solver_->statistics().islands;
  record.newton_islands = solver_->statistics().newton_islands;
}

void Simulator::sleep() {
  if (!options_.sleep.enabled) return;
  sleep_.wake_touched(acting_, cache_.contacts());
  sleep_.fall_asleep(bodies_, states_, islands_, options_.sleep, options_.dt);
  update_acting();
}

void Simulator::update_acting() {
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    acting_[i].motion = sleep_.sleeps(i) ? Motion::fixed : bodies_[i].motion;
  }
}

std::vector<std::uint8_t> Simulator::idle() const {
  std::vector<std::uint8_t> idle(acting_.size());
  for (std::size_t i = 0; i < idle.size(); ++i) idle[i] = acting_[i].motion == Motion::fixed ? 1 : 0;
  return idle;
}

std::vector<BodyPose> Simulator::poses() const {
  std::vector<BodyPose> poses;
  poses.reserve(states_.size());
  for (std::size_t i = 0; i < states_.size(); ++i) poses.push_back(pose_of(bodies_[i], states_[i]));
  return poses;
}

void Simulator::take_measures(StepRecord& record) const {
  std::size_t moving = 0;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (bodies_[i].motion != Motion::moving) continue;
    const BodyState& state = states_[i];
    const double speed = state.velocity.norm();
    record.kinetic_energy += kinetic_energy(bodies_[i], state);
    record.potential_energy -= bodies_[i].mass * options_.gravity.dot(state.position);
    record.linear_momentum += bodies_[i].mass * state.velocity;
    record.angular_momentum += angular_momentum(bodies_[i], state);
    record.speed_max = std::max(record.speed_max, speed);
    record.speed_mean += speed;
    record.spin_max = std::max(record.spin_max, bodies_[i].radius * state.angular_velocity.norm());
    ++moving;
  }
  if (moving > 0) record.speed_mean /= static_cast<double>(moving);
  record.sleeping = sleep_.count();
}

void Simulator::place(std::uint32_t body, const BodyState& state) {
  states_[body] = state;
  sleep_.wake(body);
  update_acting();
}

SimulatorState Simulator::save() const {
  const auto entries = cache_.entries();
  const auto posed = finder_->posed();
  const auto quiet = sleep_.quiet();
  const auto groups = sleep_.groups();
  return {step_,
          states_,
          {entries.begin(), entries.end()},
          {posed.begin(), posed.end()},
          {quiet.begin(), quiet.end()},
          {groups.begin(), groups.end()}};
}

void Simulator::restore(SimulatorState state) {
  step_ = state.step;
  states_ = std::move(state.states);
  cache_.restore(std::move(state.contacts));
  finder_->resume(state.posed);
  sleep_.restore(std::move(state.quiet), std::move(state.groups));
  update_acting();
}

}  // namespace tandem::simulation
