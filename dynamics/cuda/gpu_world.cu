#include "tandem/dynamics/gpu_world.h"

#include <cstring>
#include <new>
#include <optional>
#include <vector>

#include "dynamics/cuda/cuda_simulation.cuh"
#include "dynamics/cuda/parallel_newton_step.cuh"
#include "dynamics/parallel/wake_step.h"
#include "dynamics/world_calls.h"
#include "dynamics/world_rows.h"
#include "tandem/kernels/excluded_pairs.h"

namespace tandem {

using namespace dynamics;

static_assert(sizeof(GpuBodyState) == sizeof(BodyState));

class GpuWorld::State {
 public:
  std::shared_ptr<const char> of;  // Parts::placed of the bodies whose state it is
  double time, dt;
  std::vector<BodyProperties> properties;
  ParallelState<CudaExecutor> simulation;
};

struct GpuWorld::Parts : CudaSimulation {
  std::vector<AssetView> assets;
  std::shared_ptr<const char> placed;  // of these bodies alone; null where there are none
  std::vector<BodyProperties> properties;
  GpuFilter filter;
  std::vector<ObjectPair> kept_apart;  // by the caller

  // These are for continuous motion, which the CPU limits.
  std::vector<std::uint32_t> host_group, host_mask, host_world;
  ExcludedPairTable host_excluded;
  PairFilter host_filter;                        // of the above
  std::unique_ptr<ContinuousMotion> continuous;  // null: nothing limits it
  ParallelOptions options;
  bool has_contacts = false;  // those of the last step are there
  double time = 0, dt = 1;    // dt: of the last step
  std::uint64_t where = 0;

  // Copies from the GPU, for callers.
  std::vector<BodyState> states;
  std::vector<std::uint32_t> groups;
  std::vector<BodyMotion> bodies;
  std::vector<PairRecord> records;
  std::vector<ContactPoint> points;
  std::vector<ContactImpulse> done;
  std::vector<WorldContact> contacts;
  std::vector<WorldTouch> touching, began;
  std::vector<ObjectPair> ended;
  std::vector<JointMemory> joint_memory;
  std::vector<WorldJoint> joints;
  std::vector<std::uint32_t> broken;  // in the last call

  bool has_bodies() const { return simulation.has_value() && !properties.empty(); }
  void clear() {
    simulation.reset(), placed.reset(), continuous.reset();
    properties.clear();
    broken.clear();
    has_contacts = false, time = 0, dt = 1, where = 0;
  }
  Status upload_filter(const WorldSetup& setup);
  Status exclude(std::span<const Joint> joints);
  Status step(double dt, std::uint64_t& blamed);
  Status take_broken();
  Status read_states();
  Status read_contacts();
  Status read_state(std::uint32_t body, BodyState& state);
  template <typename Row, typename Get>
  Status list(const Get& get, std::vector<Row>& rows, std::span<const Row>& out);
};

namespace {

template <typename T>
Status read(CudaExecutor& executor, const T* from, std::size_t count, std::vector<T>& to) {
  to.resize(count);
  return count > 0 ? executor.copy(from, std::span<T>(to)) : executor.status();
}

}  // namespace

GpuWorld::GpuWorld() : parts_(new (std::nothrow) Parts) {}
GpuWorld::GpuWorld(GpuWorld&&) noexcept = default;
GpuWorld& GpuWorld::operator=(GpuWorld&&) noexcept = default;
GpuWorld::~GpuWorld() = default;

Status GpuWorld::fail(Status status, std::uint64_t where) const {
  if (parts_ != nullptr) parts_->where = where;
  return status;
}

Status GpuWorld::set_assets(std::span<const AssetView> assets, cudaStream_t stream) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  Parts& parts = *parts_;
  parts.clear();
  parts.assets.clear();
  try {
    std::uint64_t blamed = 0;
    const Status status = parts.CudaSimulation::set_assets(assets, stream, blamed);
    if (status != Status::kOk) return fail(status, blamed);
    parts.assets.assign(assets.begin(), assets.end());
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  return Status::kOk;
}

Status GpuWorld::set_bodies(std::span<const BodyDescription> bodies, const WorldOptions& options,
                            std::span<const ObjectPair> excluded, std::span<const JointDescription> joints) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  Parts& parts = *parts_;
  parts.clear();
  try {
    WorldSetup setup;
    std::uint64_t blamed = 0;
    Status status = set_up(parts.assets, bodies, options, joints, setup, blamed);
    if (status != Status::kOk) return fail(status, blamed);
    parts.kept_apart.assign(excluded.begin(), excluded.end());
    status = parts.upload_filter(setup);
    if (status != Status::kOk) return fail(status);
    if (options.continuous)
      parts.continuous =
          std::make_unique<ContinuousMotion>(parts.assets, options.threads, &parts.host_filter);
    parts.options = {setup.options.gravity, setup.options.solver, setup.options.sleep,
                     parts.continuous.get()};
    status = parts.CudaSimulation::set_bodies(setup.properties, setup.states, setup.joints, parts.options);
    if (status != Status::kOk) {
      parts.clear();
      return fail(status);
    }
    parts.properties = std::move(setup.properties);
    parts.placed = std::make_shared<char>();
  } catch (const std::bad_alloc&) {
    parts.clear();
    return fail(Status::kOutOfMemory);
  } catch (const QueryFailed& failed) {
    parts.clear();
    return fail(failed.status, failed.where);
  }
  return Status::kOk;
}

Status GpuWorld::Parts::upload_filter(const WorldSetup& setup) {
  host_group = setup.group, host_mask = setup.mask, host_world = setup.world;
  const bool one_world = std::ranges::all_of(host_world, [](std::uint32_t of) { return of == kEveryWorld; });
  host_filter = {nullptr, host_group.data(), host_mask.data(), one_world ? nullptr : host_world.data(), {}};
  const Status status = filter.upload(host_filter, host_group.size(), executor);
  return status == Status::kOk ? exclude(setup.joints) : status;
}

// Lets questions look past pairs that are excluded, or joined and may not touch. Throws std::bad_alloc.
Status GpuWorld::Parts::exclude(std::span<const Joint> joined) {
  ExcludedPairTable table;
  Status status = exclude_joined(kept_apart, joined, table);
  if (status == Status::kOk) status = filter.exclude(table.view(), executor);
  if (status != Status::kOk) return status;
  host_excluded = std::move(table);
  host_filter.excluded = host_excluded.view();
  questions.set_filter(filter.view());
  if (simulation.has_value()) simulation->questions_change();
  return Status::kOk;
}

// Adds the joints that broke in a step to those of the call.
Status GpuWorld::Parts::take_broken() {
  const auto of_step = simulation->broken();
  if (of_step.empty()) return Status::kOk;
  broken.insert(broken.end(), of_step.begin(), of_step.end());
  std::ranges::sort(broken);
  return exclude(simulation->joints());
}

Status GpuWorld::step(double dt, std::uint32_t steps) {
  if (parts_ != nullptr && is_duration(dt) && parts_->has_bodies())
    parts_->simulation->forget_call(), parts_->broken.clear();
  return step_more(dt, steps);
}

Status GpuWorld::step_more(double dt, std::uint32_t steps) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (!is_duration(dt)) return fail(Status::kBadDuration);
  if (!parts_->has_bodies()) return fail(Status::kOk);
  Parts& parts = *parts_;
  if (steps > 0) parts.dt = dt;
  for (std::uint32_t i = 0; i < steps; ++i) {
    std::uint64_t blamed = 0;
    const Status status = parts.step(dt, blamed);
    parts.has_contacts = status == Status::kOk;
    if (status != Status::kOk) return fail(status, blamed);
    parts.time += dt;
  }
  return fail(parts.executor.wait());
}

Status GpuWorld::Parts::step(double dt, std::uint64_t& blamed) {
  try {
    const Status status = simulation->step(dt);
    const bool of_body = status == Status::kOutOfRange && simulation->bad_body() != kNoIndex;
    blamed = of_body ? simulation->bad_body() : questions.where();
    return status == Status::kOk ? take_broken() : status;
  } catch (const QueryFailed& failed) {
    blamed = failed.where;
    return failed.status;
  } catch (const std::bad_alloc&) {
    return Status::kOutOfMemory;
  }
}

Status GpuWorld::bodies(std::span<const BodyMotion>& bodies) {
  bodies = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (!parts_->has_bodies()) return Status::kOk;
  Parts& parts = *parts_;
  try {
    const StepArrays a = parts.simulation->arrays();
    Status status = parts.read_states();
    if (status == Status::kOk) status = read(parts.executor, a.group, a.bodies, parts.groups);
    if (status != Status::kOk) return fail(status);
    parts.bodies.resize(a.bodies);
    for (std::uint32_t i = 0; i < a.bodies; ++i) {
      parts.bodies[i] = motion_of(parts.properties[i], parts.states[i], parts.groups[i] != Sleep::kAwake);
    }
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  bodies = parts.bodies;
  return Status::kOk;
}

Status GpuWorld::Parts::read_states() {
  const StepArrays a = simulation->arrays();
  return read(executor, a.start, a.bodies, states);
}

// The records of the last step are those before the next one.
Status GpuWorld::Parts::read_contacts() {
  const StepArrays a = simulation->arrays();
  const StepCounts& counts = simulation->counts();
  Status status = read(executor, a.records_before, counts.pairs, records);
  if (status == Status::kOk) status = read(executor, a.contacts, counts.remembered, points);
  if (status == Status::kOk) status = read(executor, a.done, counts.remembered, done);
  return status;
}

Status GpuWorld::contacts(std::span<const WorldContact>& contacts) {
  contacts = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (!parts_->has_contacts) return fail(Status::kOk);
  Parts& parts = *parts_;
  try {
    if (const Status status = parts.read_contacts(); status != Status::kOk) return fail(status);
    parts.contacts.clear();
    for (const PairRecord& record : parts.records) {
      for (std::uint32_t k = record.first_contact; k < record.first_contact + record.contacts; ++k) {
        parts.contacts.push_back(contact_of(parts.points[k], parts.done[k]));
      }
    }
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  contacts = parts.contacts;
  return fail(Status::kOk);
}

// Lists pairs by a function of the simulation.
template <typename Row, typename Get>
Status GpuWorld::Parts::list(const Get& get, std::vector<Row>& rows, std::span<const Row>& out) {
  if (!has_bodies()) return Status::kOk;
  try {
    const Status status = ((*simulation).*get)(rows);
    if (status == Status::kOk) out = rows;
    return status;
  } catch (const std::bad_alloc&) {
    return Status::kOutOfMemory;
  }
}

Status GpuWorld::touching(std::span<const WorldTouch>& touching) {
  touching = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  return fail(parts_->list(&CudaSimulation::Simulation::touching, parts_->touching, touching));
}

Status GpuWorld::began(std::span<const WorldTouch>& began) {
  began = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  return fail(parts_->list(&CudaSimulation::Simulation::began, parts_->began, began));
}

Status GpuWorld::ended(std::span<const ObjectPair>& ended) {
  ended = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  return fail(parts_->list(&CudaSimulation::Simulation::ended, parts_->ended, ended));
}

Status GpuWorld::joints(std::span<const WorldJoint>& joints) {
  joints = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (!parts_->has_bodies()) return fail(Status::kOk);
  Parts& parts = *parts_;
  const auto all = parts.simulation->joints();
  if (all.empty()) return fail(Status::kOk);
  try {
    Status status = parts.simulation->joint_memory(parts.joint_memory);
    if (status == Status::kOk) status = parts.read_states();
    if (status != Status::kOk) return fail(status);
    parts.joints.assign(all.size(), WorldJoint{});
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!all[i].is_gone())
        parts.joints[i] = joint_of(all[i], parts.joint_memory[i], parts.states, parts.dt);
    }
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  joints = parts.joints;
  return fail(Status::kOk);
}

Status GpuWorld::broken(std::span<const std::uint32_t>& broken) {
  broken = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  broken = parts_->broken;
  return fail(Status::kOk);
}

Status GpuWorld::add_joint(const JointDescription& description, std::uint32_t& joint) {
  if (body_count() == 0) return fail(Status::kUnknownInstance);
  Parts& parts = *parts_;
  if (const Status status = check(description, parts.properties); status != Status::kOk) return fail(status);
  try {
    Status status = parts.read_states();
    std::uint32_t place = 0;
    if (status == Status::kOk)
      status = parts.simulation->add_joint(make_joint(description, parts.states), parts.properties,
                                           parts.states, place);
    if (status != Status::kOk) return fail(status);
    status = parts.exclude(parts.simulation->joints());
    if (status != Status::kOk) {
      static_cast<void>(parts.simulation->remove_joint(place));
      return fail(status);
    }
    joint = place;
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  return fail(parts_->executor.wait());
}

Status GpuWorld::remove_joint(std::uint32_t joint) {
  const auto all = body_count() > 0 ? parts_->simulation->joints() : std::span<const Joint>();
  if (joint >= all.size() || all[joint].is_gone()) return fail(Status::kBadJoint, joint);
  try {
    Status status = parts_->simulation->remove_joint(joint);
    if (status == Status::kOk) status = parts_->exclude(parts_->simulation->joints());
    return fail(status);
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
}

Status GpuWorld::set_motor(std::uint32_t joint, double speed, double most_effort) {
  const auto all = body_count() > 0 ? parts_->simulation->joints() : std::span<const Joint>();
  const Status status = check_motor(all, joint, speed, most_effort);
  return status == Status::kOk ? fail(parts_->simulation->set_motor(joint, speed, most_effort))
                               : fail(status, joint);
}

GpuBodyState* GpuWorld::states() const {
  if (parts_ == nullptr || !parts_->has_bodies()) return nullptr;
  return reinterpret_cast<GpuBodyState*>(parts_->simulation->arrays().start);
}

std::uint32_t GpuWorld::body_count() const {
  return parts_ != nullptr ? static_cast<std::uint32_t>(parts_->properties.size()) : 0;
}

Status GpuWorld::wake() {
  if (body_count() == 0) return fail(Status::kOk);
  wake_all(parts_->executor, parts_->simulation->arrays());
  return fail(parts_->executor.wait());
}

Status GpuWorld::set(std::uint32_t body, const BodyMotion& motion) {
  if (body >= body_count()) return fail(Status::kUnknownInstance, body);
  BodyState state;
  const Status status = read_set(parts_->properties[body], motion, state);
  return status == Status::kOk ? fail(parts_->simulation->place(body, state)) : fail(status, body);
}

Status GpuWorld::Parts::read_state(std::uint32_t body, BodyState& state) {
  return executor.copy(simulation->arrays().start + body, std::span(&state, 1));
}

Status GpuWorld::push(std::uint32_t body, const double (&impulse)[3], const double (&at)[3]) {
  if (body >= body_count()) return fail(Status::kUnknownInstance, body);
  const BodyProperties& of = parts_->properties[body];
  if (of.motion != Motion::moving) return fail(Status::kOk);
  BodyState state;
  if (const Status status = parts_->read_state(body, state); status != Status::kOk) return fail(status);
  const Status status = read_push(of, impulse, at, state);
  return status == Status::kOk ? fail(parts_->simulation->place(body, state)) : fail(status, body);
}

Status GpuWorld::set_force(std::uint32_t body, const double (&force)[3], const double (&torque)[3]) {
  if (body >= body_count()) return fail(Status::kUnknownInstance, body);
  const BodyProperties& of = parts_->properties[body];
  if (of.motion != Motion::moving) return fail(Status::kOk);
  BodyState state;
  BodyForce to;
  if (const Status status = parts_->read_state(body, state); status != Status::kOk) return fail(status);
  const Status status = read_force(of, state, force, torque, to);
  return status == Status::kOk ? fail(parts_->simulation->set_force(body, to)) : fail(status, body);
}

// change(settings): makes them what they are to be.
template <typename Change>
Status GpuWorld::change(std::uint32_t body, const Change& change) {
  if (body >= body_count()) return fail(Status::kUnknownInstance, body);
  BodySettings settings = parts_->properties[body];
  change(settings);
  if (!is_usable(settings)) return fail(Status::kOutOfRange, body);
  const Status status = parts_->simulation->change(body, settings);
  if (status == Status::kOk) static_cast<BodySettings&>(parts_->properties[body]) = settings;
  return fail(status);
}

Status GpuWorld::set_material(std::uint32_t body, const Material& material) {
  return change(body, [&](BodySettings& settings) { settings.material = material; });
}

Status GpuWorld::set_gravity_scale(std::uint32_t body, double gravity_scale) {
  return change(body, [&](BodySettings& settings) { settings.gravity_scale = gravity_scale; });
}

Status GpuWorld::save(std::shared_ptr<const State>& state) const {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  try {
    auto kept = std::make_shared<State>();
    kept->of = parts_->placed, kept->time = parts_->time, kept->dt = parts_->dt;
    if (parts_->has_bodies()) {
      kept->properties = parts_->properties;
      const Status status = parts_->simulation->save(kept->simulation);
      if (status != Status::kOk) return fail(status);
    }
    state = std::move(kept);
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  return fail(Status::kOk);
}

Status GpuWorld::restore(const State& state) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (state.of != parts_->placed) return fail(Status::kKeptMismatch);
  if (!parts_->has_bodies()) return fail(Status::kOk);
  parts_->has_contacts = false;
  const Status status = parts_->simulation->restore(state.simulation);
  if (status != Status::kOk) return fail(status);
  std::ranges::copy(state.properties, parts_->properties.begin());
  parts_->time = state.time, parts_->dt = state.dt;
  parts_->broken.clear();
  try {
    return fail(parts_->exclude(parts_->simulation->joints()));
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
}

double GpuWorld::mass_of(std::uint32_t body) const {
  if (body >= body_count()) return 0;
  const BodyProperties& of = parts_->properties[body];
  return of.motion == Motion::moving ? of.mass : 0;
}

cudaError_t GpuWorld::cuda_error() const {
  if (parts_ == nullptr) return cudaErrorUnknown;
  const Parts& parts = *parts_;
  for (const cudaError_t error : {parts.error(), parts.filter.error()}) {
    if (error != cudaSuccess) return error;
  }
  return cudaErrorUnknown;
}

double GpuWorld::time() const {
  return parts_ != nullptr ? parts_->time : 0;
}

std::uint64_t GpuWorld::where() const {
  return parts_ != nullptr ? parts_->where : 0;
}

std::size_t GpuWorld::bytes() const {
  if (parts_ == nullptr) return 0;
  const Parts& parts = *parts_;
  return parts.CudaSimulation::bytes() + parts.filter.bytes();
}

}  // namespace tandem
