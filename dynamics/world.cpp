#include "tandem/dynamics/world.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <stdexcept>
#include <vector>

#include "dynamics/lists_of_steps.h"
#include "dynamics/scene_contacts.h"
#include "dynamics/simulation.h"
#include "dynamics/world_calls.h"
#include "dynamics/world_rows.h"
#include "tandem/kernels/excluded_pairs.h"

namespace tandem {

using namespace dynamics;

class World::State {
 public:
  std::shared_ptr<const char> of;  // Parts::placed of the bodies whose state it is
  double time, dt;
  SimulationState simulation;
};

struct World::Parts {
  std::vector<AssetView> assets;
  std::vector<std::uint32_t> group, mask, world;
  std::vector<ObjectPair> excluded;  // by the caller
  ExcludedPairTable apart;           // these, and those that joints keep from touching
  PairFilter filter;                 // of the above; the simulation looks at it
  std::unique_ptr<Simulation> simulation;
  std::shared_ptr<const char> placed;  // of these bodies alone; null where there are none
  std::vector<BodyMotion> bodies;
  std::vector<WorldContact> contacts;
  std::vector<WorldTouch> began;      // in the last call
  std::vector<ObjectPair> ended;      // in the last call
  std::vector<std::uint32_t> broken;  // joints, in the last call
  std::vector<WorldJoint> joints;
  double time = 0, dt = 1;  // dt: of the last step
  std::uint64_t where = 0;

  void clear() {
    simulation.reset(), placed.reset();
    bodies.clear(), contacts.clear(), joints.clear();
    forget_call();
    time = 0, dt = 1, where = 0;
  }
  void forget_call() { began.clear(), ended.clear(), broken.clear(); }
  void take_changes();
  Status filter_pairs(std::span<const Joint> joints);
  void read();
  void read_contacts();
  void read_joints();
};

World::World() : parts_(new (std::nothrow) Parts) {}
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;
World::~World() = default;

Status World::fail(Status status, std::uint64_t where) const {
  if (parts_ != nullptr) parts_->where = where;
  return status;
}

Status World::set_assets(std::span<const AssetView> assets) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  parts_->clear();
  parts_->assets.clear();
  Scene scene;
  const Status status = scene.set_assets(assets);
  if (status != Status::kOk) return fail(status, scene.where());
  try {
    parts_->assets.assign(assets.begin(), assets.end());
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  return Status::kOk;
}

Status World::set_bodies(std::span<const BodyDescription> bodies, const WorldOptions& options,
                         std::span<const ObjectPair> excluded, std::span<const JointDescription> joints) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  Parts& parts = *parts_;
  parts.clear();
  try {
    WorldSetup setup;
    std::uint64_t blamed = 0;
    const Status good = set_up(parts.assets, bodies, options, joints, setup, blamed);
    if (good != Status::kOk) return fail(good, blamed);
    parts.group = std::move(setup.group), parts.mask = std::move(setup.mask);
    parts.world = std::move(setup.world);
    parts.excluded.assign(excluded.begin(), excluded.end());
    const Status filters = parts.filter_pairs(setup.joints);
    if (filters != Status::kOk) return fail(filters);
    SimulationParts of;
    of.contacts = make_scene_contacts(parts.assets, setup.options.threads, &parts.filter);
    of.ahead = std::make_unique<ContactsAhead>(parts.assets, setup.options.threads, &parts.filter);
    if (options.continuous)
      of.continuous = std::make_unique<ContinuousMotion>(parts.assets, setup.options.threads, &parts.filter);
    of.joints = std::move(setup.joints);
    parts.simulation = std::make_unique<Simulation>(std::move(setup.properties), std::move(setup.states),
                                                    std::move(of), setup.options);
    parts.placed = std::make_shared<char>();
    parts.read();
    parts.read_joints();
  } catch (const std::bad_alloc&) {
    parts.clear();
    return fail(Status::kOutOfMemory);
  } catch (const QueryFailed& failed) {
    parts.clear();
    return fail(failed.status, failed.where);
  }
  return Status::kOk;
}

void World::Parts::read() {
  const auto properties = simulation->bodies();
  const auto states = simulation->states();
  bodies.resize(states.size());
  for (std::uint32_t i = 0; i < states.size(); ++i) {
    bodies[i] = motion_of(properties[i], states[i], simulation->sleeps(i));
  }
}

// Lets the simulation look past pairs that are excluded, or joined and may not touch.
Status World::Parts::filter_pairs(std::span<const Joint> joined) {
  ExcludedPairTable table;
  const Status status = exclude_joined(excluded, joined, table);
  if (status != Status::kOk) return status;
  apart = std::move(table);
  const bool one_world = std::ranges::all_of(world, [](std::uint32_t w) { return w == kEveryWorld; });
  filter = {nullptr, group.data(), mask.data(), one_world ? nullptr : world.data(), apart.view()};
  return Status::kOk;
}

// Adds what a step changed to the lists of the call.
void World::Parts::take_changes() {
  const Touches& touches = simulation->touches();
  add_touches(touches.began(), touches.touching(), began);
  add_pairs(touches.ended(), ended);
  broken.insert(broken.end(), simulation->broken().begin(), simulation->broken().end());
  std::ranges::sort(broken);
}

void World::Parts::read_contacts() {
  contacts.clear();
  for (const ContactPoint& point : simulation->contacts()) {
    contacts.push_back(contact_of(point, simulation->impulses()[contacts.size()]));
  }
}

void World::Parts::read_joints() {
  joints.assign(simulation->joints().size(), WorldJoint{});
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const Joint& joint = simulation->joints()[i];
    if (joint.is_gone()) continue;
    joints[i] = joint_of(joint, simulation->joint_memory()[i], simulation->states(), dt);
  }
}

Status World::step(double dt, std::uint32_t steps) {
  if (parts_ != nullptr && is_duration(dt)) parts_->forget_call();
  return step_more(dt, steps);
}

Status World::step_more(double dt, std::uint32_t steps) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (!is_duration(dt)) return fail(Status::kBadDuration);
  if (parts_->simulation == nullptr) return fail(Status::kOk);
  Parts& parts = *parts_;
  Simulation& simulation = *parts.simulation;
  Status status = Status::kOk;
  std::uint64_t blamed = 0;
  try {
    simulation.set_step(dt);
    if (steps > 0) parts.dt = dt;
    for (std::uint32_t i = 0; i < steps && status == Status::kOk; ++i) {
      SimulationState before = simulation.save();
      try {
        simulation.step();
      } catch (const QueryFailed& failed) {
        status = failed.status, blamed = failed.where;
      } catch (const std::bad_alloc&) {
        status = Status::kOutOfMemory;
      }
      const auto states = simulation.states();
      const auto lost = std::ranges::find_if_not(states, [](const BodyState& of) { return is_usable(of); });
      if (status == Status::kOk && lost != states.end())
        status = Status::kOutOfRange, blamed = static_cast<std::uint64_t>(lost - states.begin());
      if (status == Status::kOk && !simulation.broken().empty())
        status = parts.filter_pairs(simulation.joints());
      if (status != Status::kOk) {
        simulation.restore(std::move(before));
        continue;
      }
      parts.time += dt;
      parts.take_changes();
    }
    parts.read();
    parts.read_contacts();
    parts.read_joints();
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  } catch (const QueryFailed& failed) {
    return fail(failed.status, failed.where);
  }
  return fail(status, blamed);
}

std::span<const BodyMotion> World::bodies() const {
  return parts_ != nullptr ? std::span<const BodyMotion>(parts_->bodies) : std::span<const BodyMotion>();
}

std::span<const WorldContact> World::contacts() const {
  return parts_ != nullptr ? std::span<const WorldContact>(parts_->contacts)
                           : std::span<const WorldContact>();
}

std::span<const WorldTouch> World::touching() const {
  return parts_ != nullptr && parts_->simulation != nullptr ? parts_->simulation->touches().touching()
                                                            : std::span<const WorldTouch>();
}

std::span<const WorldTouch> World::began() const {
  return parts_ != nullptr ? std::span<const WorldTouch>(parts_->began) : std::span<const WorldTouch>();
}

std::span<const ObjectPair> World::ended() const {
  return parts_ != nullptr ? std::span<const ObjectPair>(parts_->ended) : std::span<const ObjectPair>();
}

std::span<const WorldJoint> World::joints() const {
  return parts_ != nullptr ? std::span<const WorldJoint>(parts_->joints) : std::span<const WorldJoint>();
}

std::span<const std::uint32_t> World::broken() const {
  return parts_ != nullptr ? std::span<const std::uint32_t>(parts_->broken)
                           : std::span<const std::uint32_t>();
}

Status World::add_joint(const JointDescription& description, std::uint32_t& joint) {
  if (bodies().empty()) return fail(Status::kUnknownInstance);
  Simulation& simulation = *parts_->simulation;
  const Status status = check(description, simulation.bodies());
  if (status != Status::kOk) return fail(status);
  try {
    const std::uint32_t place = simulation.add_joint(make_joint(description, simulation.states()));
    const Status filters = parts_->filter_pairs(simulation.joints());
    if (filters != Status::kOk) {
      simulation.remove_joint(place);
      return fail(filters);
    }
    joint = place;
    parts_->read();
    parts_->read_joints();
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  } catch (const QueryFailed& failed) {
    return fail(failed.status, failed.where);
  }
  return fail(Status::kOk);
}

Status World::remove_joint(std::uint32_t joint) {
  if (joint >= joints().size() || parts_->simulation->joints()[joint].is_gone())
    return fail(Status::kBadJoint, joint);
  try {
    std::vector<Joint> left(parts_->simulation->joints().begin(), parts_->simulation->joints().end());
    left[joint].holds = false;
    const Status filters = parts_->filter_pairs(left);
    if (filters != Status::kOk) return fail(filters);
    parts_->simulation->remove_joint(joint);
    parts_->read();
    parts_->read_joints();
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  return fail(Status::kOk);
}

Status World::set_motor(std::uint32_t joint, double speed, double most_effort) {
  if (bodies().empty()) return fail(Status::kBadJoint, joint);
  Simulation& simulation = *parts_->simulation;
  const Status status = check_motor(simulation.joints(), joint, speed, most_effort);
  if (status != Status::kOk) return fail(status, joint);
  simulation.set_motor(joint, speed, most_effort);
  parts_->read();
  return fail(Status::kOk);
}

double World::time() const {
  return parts_ != nullptr ? parts_->time : 0;
}

double World::mass_of(std::uint32_t body) const {
  if (body >= bodies().size()) return 0;
  const BodyProperties& of = parts_->simulation->bodies()[body];
  return of.motion == Motion::moving ? of.mass : 0;
}

Status World::set(std::uint32_t body, const BodyMotion& motion) {
  if (body >= bodies().size()) return fail(Status::kUnknownInstance, body);
  BodyState state;
  const Status status = read_set(parts_->simulation->bodies()[body], motion, state);
  if (status != Status::kOk) return fail(status, body);
  try {
    parts_->simulation->place(body, state);
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  parts_->read();
  return fail(Status::kOk);
}

// change(settings): makes them what they are to be.
template <typename Change>
Status World::change(std::uint32_t body, const Change& change) {
  if (body >= bodies().size()) return fail(Status::kUnknownInstance, body);
  BodySettings settings = parts_->simulation->bodies()[body];
  change(settings);
  if (!is_usable(settings)) return fail(Status::kOutOfRange, body);
  parts_->simulation->change(body, settings);
  parts_->read();
  return fail(Status::kOk);
}

Status World::set_material(std::uint32_t body, const Material& material) {
  return change(body, [&](BodySettings& settings) { settings.material = material; });
}

Status World::set_gravity_scale(std::uint32_t body, double gravity_scale) {
  return change(body, [&](BodySettings& settings) { settings.gravity_scale = gravity_scale; });
}

Status World::push(std::uint32_t body, const double (&impulse)[3], const double (&at)[3]) {
  if (body >= bodies().size()) return fail(Status::kUnknownInstance, body);
  const BodyProperties& of = parts_->simulation->bodies()[body];
  if (of.motion != Motion::moving) return fail(Status::kOk);
  BodyState state = parts_->simulation->states()[body];
  const Status status = read_push(of, impulse, at, state);
  if (status != Status::kOk) return fail(status, body);
  parts_->simulation->place(body, state);
  parts_->read();
  return fail(Status::kOk);
}

Status World::set_force(std::uint32_t body, const double (&force)[3], const double (&torque)[3]) {
  if (body >= bodies().size()) return fail(Status::kUnknownInstance, body);
  const BodyProperties& of = parts_->simulation->bodies()[body];
  if (of.motion != Motion::moving) return fail(Status::kOk);
  BodyForce to;
  const Status status = read_force(of, parts_->simulation->states()[body], force, torque, to);
  if (status != Status::kOk) return fail(status, body);
  try {
    parts_->simulation->set_force(body, to);
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  parts_->read();
  return fail(Status::kOk);
}

Status World::save(std::shared_ptr<const State>& state) const {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  try {
    auto kept = std::make_shared<State>();
    kept->of = parts_->placed;
    kept->time = parts_->time, kept->dt = parts_->dt;
    if (parts_->simulation != nullptr) kept->simulation = parts_->simulation->save();
    state = std::move(kept);
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  return fail(Status::kOk);
}

Status World::restore(const State& state) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (state.of != parts_->placed) return fail(Status::kKeptMismatch);
  if (state.of == nullptr) return fail(Status::kOk);
  try {
    parts_->simulation->restore(state.simulation);
    const Status filters = parts_->filter_pairs(parts_->simulation->joints());
    if (filters != Status::kOk) return fail(filters);
    parts_->time = state.time, parts_->dt = state.dt;
    parts_->contacts.clear(), parts_->forget_call();
    parts_->read();
    parts_->read_joints();
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  } catch (const QueryFailed& failed) {
    return fail(failed.status, failed.where);
  }
  return fail(Status::kOk);
}

std::uint64_t World::where() const {
  return parts_ != nullptr ? parts_->where : 0;
}

}  // namespace tandem
