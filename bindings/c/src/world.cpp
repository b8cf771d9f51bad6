#include "tandem/dynamics/world.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "bodies.h"
#include "handles.h"
#include "rows.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_world : Allocated {
  Allocator allocator;
  AssetReferences assets;
  WorldOptions options;
  World world;
  uint64_t where = 0;

  tandem_status fail(tandem_status status, uint64_t at) {
    where = at;
    return status;
  }
  tandem_status told(Status status) {
    return status == Status::kOk ? tandem_status{TANDEM_OK} : fail(to_c(status), world.where());
  }
};

struct tandem_world_state : Allocated {
  Allocator allocator;
  std::shared_ptr<const World::State> state;
};

namespace {

// Runs the body of a function, see guarded(); `where` begins as 0.
template <typename Body>
tandem_status enter(tandem_world* world, const Body& body) noexcept {
  return guarded(world, [&](tandem_world& self) -> tandem_status {
    self.where = 0;
    try {
      return body(self);
    } catch (const std::bad_alloc&) {
      return TANDEM_OUT_OF_MEMORY;
    }
  });
}

template <typename Row, typename Of>
const Row* rows_of(const tandem_world* world, std::span<const Of> (World::*get)() const, size_t* count) {
  return result<Row>(world != nullptr ? (world->world.*get)() : std::span<const Of>(), count);
}

// Calls a function of one body and two vectors.
template <typename Function>
tandem_status call_with_two(tandem_world* world, Function call, uint32_t body, const double* p,
                            const double* q) noexcept {
  return enter(world, [&](tandem_world& self) -> tandem_status {
    if (p == nullptr || q == nullptr) return TANDEM_NULL_ARGUMENT;
    return self.told((self.world.*call)(body, {p[0], p[1], p[2]}, {q[0], q[1], q[2]}));
  });
}

// An option that a flag says to be 0; left alone where it has its default. False: both say something, or one
// says what it cannot.
bool read_option(uint32_t is_zero, double given, double& option) {
  if (is_zero > 1 || (is_zero == 1 && given != 0) || !(given >= 0)) return false;
  if (is_zero == 1 || given != 0) option = given;
  return true;
}

// The world checks how large they are.
tandem_status read_options(const tandem_world_options* given, WorldOptions& options) {
  tandem_world_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  const bool falls = std::ranges::any_of(read.gravity, [](double g) { return g != 0; });
  const bool good =
      read_option(read.no_friction, read.friction, options.friction) &&
      read_option(read.no_slop, read.slop, options.slop) &&
      read_option(read.no_rolling_resistance, read.rolling_resistance, options.rolling_resistance) &&
      read.no_gravity <= 1 && !(read.no_gravity == 1 && falls) && read.no_sleeping <= 1 &&
      read.continuous <= 1 && read.reserved == 0;
  if (!good) return TANDEM_BAD_OPTION;
  if (falls || read.no_gravity == 1) std::ranges::copy(read.gravity, options.gravity);
  options.restitution = read.restitution;
  if (read.substeps != 0) options.substeps = read.substeps;
  if (read.threads != 0) options.threads = read.threads;
  options.sleeping = read.no_sleeping == 0;
  options.continuous = read.continuous != 0;
  return TANDEM_OK;
}

// Result: TANDEM_OK, TANDEM_BAD_STRUCT_SIZE, TANDEM_BAD_OPTION or TANDEM_MOTION_MISMATCH.
tandem_status read_start(const tandem_body_start* given, size_t bodies, tandem_body_start& read) {
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.reserved != 0) return TANDEM_BAD_OPTION;
  const double* const rows[] = {read.density,      read.velocity,    read.angular_velocity,
                                read.friction,     read.restitution, read.rolling_resistance,
                                read.gravity_scale};
  const bool has_rows = std::ranges::any_of(rows, [](const double* row) { return row != nullptr; });
  return has_rows && read.count != bodies ? TANDEM_MOTION_MISMATCH : TANDEM_OK;
}

// The pairs of a filter in the order of its table. Result: TANDEM_OK or TANDEM_UNKNOWN_INSTANCE.
tandem_status read_excluded(const tandem_excluded_pairs* given, size_t bodies, std::vector<ObjectPair>& pairs,
                            uint64_t& where) {
  if (given == nullptr) return TANDEM_OK;
  if (given->table.view().instances > bodies) {
    where = given->table.view().row;
    return TANDEM_UNKNOWN_INSTANCE;
  }
  for (const uint64_t key : given->table.slots()) {
    if (key != ExcludedPairs::kEmpty)
      pairs.push_back({static_cast<uint32_t>(key >> 32), static_cast<uint32_t>(key)});
  }
  return TANDEM_OK;
}

// Result: TANDEM_OK or TANDEM_BAD_JOINT.
tandem_status read_joint(const tandem_joint& from, JointDescription& joint) {
  const bool is_limited = from.has_limits != 0 || from.least != 0 || from.most != 0;
  if (from.kind > TANDEM_DISTANCE || from.has_limits > 1 || from.may_touch > 1 ||
      (is_limited && from.has_limits == 0) || from.reserved[0] != 0 || from.reserved[1] != 0)
    return TANDEM_BAD_JOINT;
  joint.kind = static_cast<JointKind>(from.kind);
  joint.a = from.a, joint.b = from.b;
  std::ranges::copy(from.anchor, joint.anchor);
  std::ranges::copy(from.anchor_b, joint.anchor_b);
  std::ranges::copy(from.axis, joint.axis);
  if (from.has_limits != 0) joint.least = from.least, joint.most = from.most;
  joint.speed = from.speed, joint.most_effort = from.most_effort;
  if (from.breaking_force != 0) joint.breaking_force = from.breaking_force;
  if (from.breaking_torque != 0) joint.breaking_torque = from.breaking_torque;
  joint.may_touch = from.may_touch != 0;
  return TANDEM_OK;
}

// Result: TANDEM_OK, TANDEM_NULL_ARGUMENT or, where `where` is the joint, TANDEM_BAD_JOINT.
tandem_status read_joints(const tandem_body_start& given, std::vector<JointDescription>& joints,
                          uint64_t& where) {
  if (!is_there(given.joints, given.joint_count)) return TANDEM_NULL_ARGUMENT;
  for (size_t i = 0; i < given.joint_count; ++i) {
    if (const tandem_status status = read_joint(given.joints[i], joints.emplace_back());
        status != TANDEM_OK) {
      where = i;
      return status;
    }
  }
  return TANDEM_OK;
}

tandem_status set_bodies(tandem_world& self, const tandem_instance* instances, size_t count,
                         const tandem_pair_filter* filter, const tandem_body_start* start) {
  if (!is_there(instances, count)) return TANDEM_NULL_ARGUMENT;
  tandem_pair_filter read;
  tandem_body_start starts;
  std::vector<ObjectPair> excluded;
  tandem_status status = read_filter(filter, count, read, self.where);
  if (status == TANDEM_OK) status = read_start(start, count, starts);
  if (status == TANDEM_OK) status = read_excluded(read.excluded, count, excluded, self.where);
  std::vector<JointDescription> joints;
  if (status == TANDEM_OK) status = read_joints(starts, joints, self.where);
  if (status != TANDEM_OK) return status;
  std::vector<BodyDescription> bodies(count);
  for (size_t i = 0; i < count; ++i) {
    BodyDescription& body = bodies[i];
    body.asset = instances[i].asset;
    body.pose = std::bit_cast<Pose>(instances[i].pose);
    if (read.motion != nullptr) body.filter.motion = static_cast<Motion>(read.motion[i]);
    if (read.group != nullptr) body.filter.group = read.group[i];
    if (read.mask != nullptr) body.filter.mask = read.mask[i];
    if (read.world != nullptr) body.filter.world = read.world[i];
    const auto take = [i](const double* from, double& to) { to = from != nullptr ? from[i] : to; };
    take(starts.density, body.density);
    take(starts.friction, body.material.friction);
    take(starts.restitution, body.material.restitution);
    take(starts.rolling_resistance, body.material.rolling_resistance);
    take(starts.gravity_scale, body.gravity_scale);
    if (starts.velocity != nullptr) std::copy_n(starts.velocity + 3 * i, 3, body.velocity);
    if (starts.angular_velocity != nullptr)
      std::copy_n(starts.angular_velocity + 3 * i, 3, body.angular_velocity);
  }
  const Status placed = self.world.set_bodies(bodies, self.options, excluded, joints);
  if (placed != Status::kNoTopology) return self.told(placed);
  return self.fail(to_c(placed), bodies[self.world.where()].asset);
}

}  // namespace

tandem_status tandem_world_create(const tandem_world_options* options, const tandem_allocator* allocator,
                                  tandem_world** world) {
  return create(allocator, world, [&](tandem_world& made) -> tandem_status {
    const tandem_status status = read_options(options, made.options);
    return status == TANDEM_OK ? made.told(made.world.set_bodies({}, made.options)) : status;
  });
}

void tandem_world_destroy(tandem_world* world) {
  delete world;
}

tandem_status tandem_world_set_assets(tandem_world* world, tandem_asset* const* assets, size_t count) {
  return enter(world, [&](tandem_world& self) {
    return self.assets.replace(assets, count, self.where, [&](std::span<const AssetView> views) {
      return self.told(self.world.set_assets(views));
    });
  });
}

tandem_status tandem_world_set_bodies(tandem_world* world, const tandem_instance* instances, size_t count,
                                      const tandem_pair_filter* filter, const tandem_body_start* start) {
  return enter(world, [&](tandem_world& self) {
    const tandem_status status = set_bodies(self, instances, count, filter, start);
    if (status != TANDEM_OK) (void)self.world.set_bodies({}, self.options);
    return status;
  });
}

tandem_status tandem_world_step(tandem_world* world, double dt, uint32_t steps) {
  return enter(world, [&](tandem_world& self) { return self.told(self.world.step(dt, steps)); });
}

const tandem_body_motion* tandem_world_bodies(const tandem_world* world, size_t* count) {
  return rows_of<tandem_body_motion>(world, &World::bodies, count);
}

const tandem_world_contact* tandem_world_contacts(const tandem_world* world, size_t* count) {
  return rows_of<tandem_world_contact>(world, &World::contacts, count);
}

const tandem_world_touch* tandem_world_touching(const tandem_world* world, size_t* count) {
  return rows_of<tandem_world_touch>(world, &World::touching, count);
}

const tandem_world_touch* tandem_world_began(const tandem_world* world, size_t* count) {
  return rows_of<tandem_world_touch>(world, &World::began, count);
}

const tandem_object_pair* tandem_world_ended(const tandem_world* world, size_t* count) {
  return rows_of<tandem_object_pair>(world, &World::ended, count);
}

const tandem_world_joint* tandem_world_joints(const tandem_world* world, size_t* count) {
  return rows_of<tandem_world_joint>(world, &World::joints, count);
}

const uint32_t* tandem_world_broken(const tandem_world* world, size_t* count) {
  return rows_of<uint32_t>(world, &World::broken, count);
}

tandem_status tandem_world_add_joint(tandem_world* world, const tandem_joint* joint, uint32_t* place) {
  return enter(world, [&](tandem_world& self) -> tandem_status {
    if (joint == nullptr || place == nullptr) return TANDEM_NULL_ARGUMENT;
    JointDescription read;
    const tandem_status status = read_joint(*joint, read);
    return status == TANDEM_OK ? self.told(self.world.add_joint(read, *place)) : status;
  });
}

tandem_status tandem_world_remove_joint(tandem_world* world, uint32_t joint) {
  return enter(world, [&](tandem_world& self) { return self.told(self.world.remove_joint(joint)); });
}

tandem_status tandem_world_set_motor(tandem_world* world, uint32_t joint, double speed, double most_effort) {
  return enter(
      world, [&](tandem_world& self) { return self.told(self.world.set_motor(joint, speed, most_effort)); });
}

double tandem_world_time(const tandem_world* world) {
  return world != nullptr ? world->world.time() : 0;
}

double tandem_world_mass(const tandem_world* world, uint32_t body) {
  return world != nullptr ? world->world.mass_of(body) : 0;
}

tandem_status tandem_world_set_body(tandem_world* world, uint32_t body, const tandem_body_motion* motion) {
  return enter(world, [&](tandem_world& self) -> tandem_status {
    if (motion == nullptr) return TANDEM_NULL_ARGUMENT;
    BodyMotion read = {};
    read.pose = std::bit_cast<Pose>(motion->pose);
    std::ranges::copy(motion->velocity, read.velocity);
    std::ranges::copy(motion->angular_velocity, read.angular_velocity);
    return self.told(self.world.set(body, read));
  });
}

tandem_status tandem_world_set_material(tandem_world* world, uint32_t body, double friction,
                                        double restitution, double rolling_resistance) {
  return enter(world, [&](tandem_world& self) {
    return self.told(self.world.set_material(body, {friction, restitution, rolling_resistance}));
  });
}

tandem_status tandem_world_set_gravity_scale(tandem_world* world, uint32_t body, double gravity_scale) {
  return enter(world, [&](tandem_world& self) {
    return self.told(self.world.set_gravity_scale(body, gravity_scale));
  });
}

tandem_status tandem_world_push(tandem_world* world, uint32_t body, const double* impulse, const double* at) {
  return call_with_two(world, &World::push, body, impulse, at);
}

tandem_status tandem_world_set_force(tandem_world* world, uint32_t body, const double* force,
                                     const double* torque) {
  return call_with_two(world, &World::set_force, body, force, torque);
}

tandem_status tandem_world_save(const tandem_world* world, tandem_world_state** state) {
  if (state != nullptr) *state = nullptr;
  if (world == nullptr) return TANDEM_NULL_ARGUMENT;
  const Allocator& from = world->allocator;
  const tandem_allocator allocator = {sizeof allocator, 0, from.user, from.allocate, from.deallocate};
  return create(from.allocate != nullptr ? &allocator : nullptr, state,
                [&](tandem_world_state& made) { return to_c(world->world.save(made.state)); });
}

tandem_status tandem_world_restore(tandem_world* world, const tandem_world_state* state) {
  return enter(world, [&](tandem_world& self) -> tandem_status {
    return state != nullptr ? self.told(self.world.restore(*state->state))
                            : tandem_status{TANDEM_NULL_ARGUMENT};
  });
}

void tandem_world_state_destroy(tandem_world_state* state) {
  delete state;
}

uint64_t tandem_world_where(const tandem_world* world) {
  return world != nullptr ? world->where : 0;
}
