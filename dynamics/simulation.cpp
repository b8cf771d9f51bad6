#include "dynamics/simulation.h"

#include <algorithm>
#include <iterator>

#include "dynamics/joint_order.h"
#include "dynamics/joint_rules.h"
#include "kernels/common/stopwatch.h"

namespace tandem::dynamics {
namespace {

void add(StepRecord& record, const FinderReport& report) {
  record.update += report.times.update;
  record.broad_phase += report.times.broad_phase;
  record.traversal += report.times.traversal;
  record.triangle_tests += report.times.triangle_tests;
  record.transfer += report.times.transfer;
  record.generation += report.times.generation;
  record.object_pairs += report.counters.object_pairs;
  record.kept_pairs += report.kept_pairs;
  record.block_pairs += report.counters.block_pairs;
  record.candidates += report.counters.candidates;
  record.triangle_pairs += report.counters.contacts;
  record.segments += report.contacts.counters.segments;
  record.patches += report.contacts.counters.manifolds;
  record.open_curves += report.contacts.counters.open_curves;
  record.contact_area += report.contacts.area;
}

}  // namespace

void measure(std::span<const BodyProperties> bodies, std::span<const BodyState> states,
             const Vector3& gravity, StepRecord& record) {
  std::size_t moving = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (bodies[i].motion != Motion::moving) continue;
    const BodyState& state = states[i];
    const double speed = norm(state.velocity);
    record.kinetic_energy += kinetic_energy(bodies[i], state);
    record.potential_energy -= bodies[i].gravity_scale * bodies[i].mass * dot(gravity, state.position);
    record.linear_momentum += bodies[i].mass * state.velocity;
    record.angular_momentum += angular_momentum(bodies[i], state);
    record.speed_max = std::max(record.speed_max, speed);
    record.speed_mean += speed;
    record.spin_max = std::max(record.spin_max, bodies[i].radius * norm(state.angular_velocity));
    ++moving;
  }
  if (moving > 0) record.speed_mean /= static_cast<double>(moving);
}

Simulation::Simulation(std::vector<BodyProperties> bodies, std::vector<BodyState> states,
                       SimulationParts parts, const SimulationOptions& options)
    : bodies_(std::move(bodies)),
      acting_(bodies_),
      states_(std::move(states)),
      parts_(std::move(parts)),
      options_(options),
      joints_(std::move(parts_.joints)),
      joint_memory_(joints_.size()) {
  find_joined();
  follow_joints(0);
  if (parts_.solver == nullptr) parts_.solver = make_step_solver(options.solver);
  sleep_.start(bodies_.size());
}

StepRecord Simulation::step() {
  Stopwatch step, phase;
  StepRecord record;
  find_pulls();
  find_contacts(record);
  phase.lap();
  solve(record);
  sleep();
  record.solver_seconds = phase.lap();
  record.time = static_cast<double>(++step_) * options_.dt;
  measure(bodies_, states_, options_.gravity, record);
  record.sleeping = sleep_.count();
  record.step_seconds = step.lap();
  return record;
}

void Simulation::find_pulls() {
  pulls_.resize(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    pulls_[i] = pull_on(bodies_[i], states_[i], options_.gravity, forces_.empty() ? BodyForce{} : forces_[i]);
}

void Simulation::find_contacts(StepRecord& record) {
  const std::vector<std::uint8_t> idle = this->idle();
  const BodiesAhead ahead = {acting_, states_, idle, options_.dt, pulls_, options_.solver.slop};
  const std::vector<ObjectPair> touching = cache_.pairs();
  Keeping keeping = {touching, options_.solver.slop};
  Stopwatch stopwatch;
  std::vector<ObjectPair> remembered, near;
  std::span<const ObjectPair> known;  // of the middle
  if (parts_.ahead) {
    parts_.ahead->find_near(ahead);
    record.broad_phase += stopwatch.lap();
    known = parts_.ahead->find_in_middle(cache_.entries(), ahead);
    add(record, parts_.ahead->report());
    std::vector<ObjectPair> all;
    std::ranges::set_union(touching, parts_.ahead->slow(), std::back_inserter(all));
    std::ranges::set_difference(all, known, std::back_inserter(remembered));
    std::ranges::set_difference(parts_.ahead->fast(), known, std::back_inserter(near));
    keeping.remembered = remembered, keeping.near = near;
  }
  found_ = parts_.contacts->find(poses(), idle, keeping);
  add(record, parts_.contacts->report());
  stopwatch.lap();
  // A finder that asks about all pairs has found these too.
  std::erase_if(found_, [&](const ContactPoint& contact) {
    return std::ranges::binary_search(known, pair_of(contact));
  });
  if (parts_.ahead) parts_.ahead->add_to(found_, parts_.contacts->kept(), ahead);
  drop_contacts_of_fixed();
  kept_.assign(parts_.contacts->kept().begin(), parts_.contacts->kept().end());
  cache_.update(found_, kept_, ahead, options_.threads);
  record.generation += stopwatch.lap();
  record.contacts = cache_.contacts().size();
  for (const ContactPoint& contact : cache_.contacts()) {
    const double depth = std::max(contact.depth, 0.0);
    record.penetration_max = std::max(record.penetration_max, depth);
    record.penetration_mean += depth / static_cast<double>(record.contacts);
  }
}

// A fixed body that was placed is asked for contacts with all other bodies.
void Simulation::drop_contacts_of_fixed() {
  if (placed_.empty()) return;
  std::erase_if(found_, [&](const ContactPoint& contact) {
    return !are_told(bodies_[contact.body_a], bodies_[contact.body_b]);
  });
}

// A step that misses contacts is solved again with them: what pushes a body may be found by no question that
// is asked before, since the velocity that it gives is not known yet.
void Simulation::solve(StepRecord& record) {
  constexpr int kMostTimes = 3;
  const std::vector<BodyState> before = states_;
  const std::vector<JointMemory> joints_before = joint_memory_;
  std::vector<ContactImpulse> impulses = solve_contacts();
  for (int times = 1; times < kMostTimes && find_missed(before); ++times) {
    states_ = before, joint_memory_ = joints_before;
    impulses = solve_contacts();
  }
  if (parts_.continuous) parts_.continuous->limit(acting_, joined_, before, states_, options_.solver.slop);
  follow_joints(options_.dt);
  break_joints();
  cache_.remember(impulses);
  std::vector<double> approach;
  approach.reserve(cache_.contacts().size());
  for (const ContactPoint& contact : cache_.contacts()) approach.push_back(approach_of(contact, before));
  touches_.update(cache_.contacts(), done_, approach, idle());
  record.residual_max = parts_.solver->statistics().residual;
  record.residual_rms = parts_.solver->statistics().residual_rms;
  record.islands = parts_.solver->statistics().islands;
  record.newton_islands = parts_.solver->statistics().newton_islands;
}

std::vector<ContactImpulse> Simulation::solve_contacts() {
  const std::span<const ContactPoint> contacts = cache_.contacts();
  islands_ = find_islands(acting_, contacts, joined_);
  std::vector<ContactImpulse> impulses =
      options_.solver.warm_start ? cache_.impulses() : std::vector<ContactImpulse>(contacts.size());
  done_.assign(contacts.size(), {});
  parts_.solver->step({{acting_, contacts, options_.dt, pulls_},
                       islands_,
                       step_,
                       cache_.is_cold(),
                       options_.threads,
                       joints_,
                       joint_memory_,
                       done_,
                       joint_colours_},
                      states_, impulses);
  return impulses;
}

// Returns whether the step, which began with the bodies like this, missed contacts, and adds them.
bool Simulation::find_missed(std::span<const BodyState> before) {
  if (!parts_.ahead) return false;
  const std::vector<std::uint8_t> idle = this->idle();
  const BodiesAhead start = {acting_, before, idle, options_.dt, pulls_, options_.solver.slop};
  const std::span<const ObjectPair> missed =
      parts_.ahead->add_missed(found_, cache_.contacts(), start, states_);
  if (missed.empty()) return false;
  std::erase_if(kept_, [&](const ObjectPair& pair) { return std::ranges::binary_search(missed, pair); });
  cache_.update_again(found_, kept_, start, options_.threads);
  return true;
}

void Simulation::sleep() {
  if (!options_.sleep.enabled) return;
  std::vector<std::uint8_t> driven;
  for (const Joint& joint : joints_) driven.push_back(joint.is_driven());
  sleep_.wake_touched(acting_, cache_.contacts(), joined_);
  wake_beside_placed();
  sleep_.fall_asleep(bodies_, states_, islands_, options_.sleep, options_.dt, driven);
  update_acting();
}

void Simulation::wake_beside_placed() {
  if (placed_.empty()) return;
  for (const ContactPoint& contact : cache_.contacts()) {
    if (placed_[contact.body_a]) sleep_.wake(contact.body_b);
    if (placed_[contact.body_b]) sleep_.wake(contact.body_a);
  }
  placed_.clear();
}

void Simulation::update_acting() {
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    acting_[i].motion = sleep_.sleeps(i) ? Motion::fixed : bodies_[i].motion;
  }
}

std::vector<std::uint8_t> Simulation::idle() const {
  std::vector<std::uint8_t> idle(acting_.size());
  for (std::size_t i = 0; i < idle.size(); ++i)
    idle[i] = acting_[i].motion == Motion::fixed && (placed_.empty() || placed_[i] == 0) ? 1 : 0;
  return idle;
}

std::vector<Instance> Simulation::poses() const {
  std::vector<Instance> poses;
  poses.reserve(states_.size());
  for (std::size_t i = 0; i < states_.size(); ++i) poses.push_back(pose_of(bodies_[i], states_[i]));
  return poses;
}

void Simulation::place(std::uint32_t body, const BodyState& state) {
  if (bodies_[body].motion == Motion::fixed) {
    placed_.resize(bodies_.size());
    placed_[body] = 1;
  }
  states_[body] = state;
  wake(body);
}

void Simulation::wake(std::uint32_t body) {
  sleep_.wake(body);
  if (bodies_[body].motion != Motion::moving) {
    const auto wake_other = [&](const ObjectPair& pair) {
      const std::uint32_t other = pair.a == body ? pair.b : pair.a;
      if ((pair.a == body || pair.b == body) && other != kNoIndex) sleep_.wake(other);
    };
    for (const WorldTouch& touch : touches_.touching()) wake_other({touch.a, touch.b});
    std::ranges::for_each(joined_, wake_other);
  }
  update_acting();
}

void Simulation::set_force(std::uint32_t body, const BodyForce& force) {
  if (forces_.empty()) forces_.resize(bodies_.size());
  if (forces_[body] == force) return;
  forces_[body] = force;
  wake(body);
}

void Simulation::change(std::uint32_t body, const BodySettings& settings) {
  BodySettings& of = bodies_[body];
  if (of == settings) return;
  of = settings;
  static_cast<BodySettings&>(acting_[body]) = settings;
  wake(body);
}

void Simulation::follow_joints(double time) {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    follow(joint, state_of(joint.a, states_), state_of(joint.b, states_), time, joint_memory_[i]);
  }
}

void Simulation::set_motor(std::uint32_t joint, double speed, double most_effort) {
  joints_[joint].speed = speed, joints_[joint].most_effort = most_effort;
  wake_joined(joints_[joint]);
  update_acting();
}

std::uint32_t Simulation::add_joint(const Joint& joint) {
  const std::uint32_t place = free_place(joints_);
  // What may throw comes first.
  if (!joint.may_touch) forget_contacts({std::min(joint.a, joint.b), std::max(joint.a, joint.b)});
  const std::size_t count = std::max<std::size_t>(joints_.size(), place + 1);
  joint_memory_.reserve(count), joined_.reserve(count), joints_.resize(count), joint_memory_.resize(count);
  joints_[place] = joint;
  joint_memory_[place] = memory_of(joint, states_);
  find_joined();
  wake_joined(joint);
  update_acting();
  return place;
}

void Simulation::remove_joint(std::uint32_t joint) {
  wake_joined(joints_[joint]);
  joints_[joint] = gone_joint();
  joint_memory_[joint] = {};
  find_joined();
  update_acting();
}

void Simulation::find_joined() {
  joined_.clear();
  for (const Joint& joint : joints_) joined_.push_back(joint.pair());
  joint_colours_ = find_joint_colours(joints_, motions_of(bodies_));
}

void Simulation::wake_joined(const Joint& joint) {
  for (const std::uint32_t body : {joint.a, joint.b}) {
    if (body != kNoIndex) sleep_.wake(body);
  }
}

// The pair is asked for contacts when it is next near, as if it had never been.
void Simulation::forget_contacts(const ObjectPair& pair) {
  const auto entries = cache_.entries();
  const auto posed = parts_.contacts->posed();
  std::vector<CachedContact> others(entries.begin(), entries.end());
  std::vector<PosedBodies> other_bodies(posed.begin(), posed.end());
  std::erase_if(others, [&](const CachedContact& entry) { return entry.pair == pair; });
  std::erase_if(other_bodies, [&](const PosedBodies& of) { return of.pair == pair; });
  parts_.contacts->resume(other_bodies);
  cache_.restore(std::move(others));
}

// A joint that does not hold does nothing from the step after it broke.
void Simulation::break_joints() {
  broken_.clear();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (!joints_[i].holds) joint_memory_[i].impulse = joint_memory_[i].done = {};
  }
  for (const std::uint32_t i : islands_.joints) {
    const Joint& joint = joints_[i];
    if (breaks(joint, joint_memory_[i], state_of(joint.a, states_), state_of(joint.b, states_), options_.dt))
      broken_.push_back(i);
  }
  std::ranges::sort(broken_);
  for (const std::uint32_t i : broken_) {
    joints_[i].holds = false;
    wake_joined(joints_[i]);
  }
  find_joined();
}

SimulationState Simulation::save() const {
  const auto entries = cache_.entries();
  const auto posed = parts_.contacts->posed();
  const auto quiet = sleep_.quiet();
  const auto groups = sleep_.groups();
  const auto touching = touches_.touching();
  return {step_,
          states_,
          {entries.begin(), entries.end()},
          {posed.begin(), posed.end()},
          parts_.ahead ? parts_.ahead->save() : AheadState{},
          {quiet.begin(), quiet.end()},
          {groups.begin(), groups.end()},
          forces_,
          {bodies_.begin(), bodies_.end()},
          placed_,
          {touching.begin(), touching.end()},
          joints_,
          joint_memory_};
}

void Simulation::restore(SimulationState state) {
  step_ = state.step;
  states_ = std::move(state.states);
  cache_.restore(std::move(state.contacts));
  parts_.contacts->resume(state.posed);
  if (parts_.ahead) parts_.ahead->restore(std::move(state.ahead));
  sleep_.restore(std::move(state.quiet), std::move(state.groups));
  forces_ = std::move(state.forces);
  for (std::size_t i = 0; i < state.settings.size(); ++i) {
    static_cast<BodySettings&>(bodies_[i]) = state.settings[i];
    static_cast<BodySettings&>(acting_[i]) = state.settings[i];
  }
  placed_ = std::move(state.placed);
  touches_.restore(std::move(state.touching));
  joints_ = std::move(state.joints);
  joint_memory_ = std::move(state.joint_memory);
  broken_.clear();
  find_joined();
  update_acting();
}

}  // namespace tandem::dynamics
