#include "tandem/dynamics/world.h"

#include <memory>
#include <span>

#include "world_handle.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_world : WorldHandle<World> {};

struct tandem_world_state : Allocated {
  Allocator allocator;
  std::shared_ptr<const World::State> state;
};

namespace {

template <typename Row, typename Of>
const Row* rows_of(const tandem_world* world, std::span<const Of> (World::*get)() const, size_t* count) {
  return result<Row>(world != nullptr ? (world->world.*get)() : std::span<const Of>(), count);
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
  return set_world_assets(world, assets, count, [](tandem_world& self, std::span<const AssetView> views) {
    return self.world.set_assets(views);
  });
}

tandem_status tandem_world_set_bodies(tandem_world* world, const tandem_instance* instances, size_t count,
                                      const tandem_pair_filter* filter, const tandem_body_start* start) {
  return place_bodies(
      world, instances, count, filter, start, [](tandem_world& self, const GivenBodies& given) {
        return self.world.set_bodies(given.bodies, self.options, given.excluded, given.joints);
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
  return set_body(world, body, motion);
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
