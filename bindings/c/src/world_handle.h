#pragma once
#include <memory>
#include <new>

#include "given_bodies.h"
#include "handles.h"
#include "rows.h"

/// Functions of worlds on the CPU and on a GPU begin and end with these.
namespace tandem::c {

/// The base of the handle of a world, which is a World or a GpuWorld.
template <typename Of>
struct WorldHandle : Allocated {
  Allocator allocator;
  AssetReferences assets;
  WorldOptions options;
  Of world;
  uint64_t where = 0;

  tandem_status fail(tandem_status status, uint64_t at) {
    where = at;
    return status;
  }
  /// The interface's number of what the world returned. A handle that keeps more of an error hides both.
  tandem_status number_of(Status status) const { return to_c(status); }
  tandem_status told(Status status) {
    return status == Status::kOk ? tandem_status{TANDEM_OK} : fail(to_c(status), world.where());
  }
};

/// The base of the handle of a world's state.
template <typename Of>
struct WorldStateHandle : Allocated {
  Allocator allocator;
  std::shared_ptr<const typename Of::State> state;
};

/// Runs the body of a function, see guarded(); `where` begins as 0.
template <typename Handle, typename Body>
tandem_status enter(Handle* world, const Body& body) noexcept {
  return guarded(world, [&](Handle& self) -> tandem_status {
    self.where = 0;
    try {
      return body(self);
    } catch (const std::bad_alloc&) {
      return TANDEM_OUT_OF_MEMORY;
    }
  });
}

/// Gives a world its assets by set(views), which returns a Status.
template <typename Handle, typename Set>
tandem_status set_world_assets(Handle* world, tandem_asset* const* assets, size_t count,
                               const Set& set) noexcept {
  return enter(world, [&](Handle& self) {
    return self.assets.replace(assets, count, self.where,
                               [&](std::span<const AssetView> views) { return self.told(set(self, views)); });
  });
}

/// Places bodies by place(given), which returns a Status. After an error there are none.
template <typename Handle, typename Place>
tandem_status place_bodies(Handle* world, const tandem_instance* instances, size_t count,
                           const tandem_pair_filter* filter, const tandem_body_start* start,
                           const Place& place) noexcept {
  return enter(world, [&](Handle& self) {
    GivenBodies given;
    tandem_status status = read_bodies(instances, count, filter, start, given, self.where);
    if (status == TANDEM_OK) {
      const Status placed = place(self, given);
      status = self.told(placed);
      if (placed == Status::kNoTopology) self.where = given.bodies[self.world.where()].asset;
    }
    if (status != TANDEM_OK) (void)self.world.set_bodies({}, self.options);
    return status;
  });
}

template <typename Handle>
tandem_status set_body(Handle* world, uint32_t body, const tandem_body_motion* motion) noexcept {
  return enter(world, [&](Handle& self) -> tandem_status {
    if (motion == nullptr) return TANDEM_NULL_ARGUMENT;
    return self.told(self.world.set(body, read_motion(*motion)));
  });
}

/// Calls a function of one body and two vectors.
template <typename Handle, typename Function>
tandem_status call_with_two(Handle* world, Function call, uint32_t body, const double* p,
                            const double* q) noexcept {
  return enter(world, [&](Handle& self) -> tandem_status {
    if (p == nullptr || q == nullptr) return TANDEM_NULL_ARGUMENT;
    return self.told((self.world.*call)(body, {p[0], p[1], p[2]}, {q[0], q[1], q[2]}));
  });
}

template <typename Handle>
tandem_status add_joint(Handle* world, const tandem_joint* joint, uint32_t* place) noexcept {
  return enter(world, [&](Handle& self) -> tandem_status {
    if (joint == nullptr || place == nullptr) return TANDEM_NULL_ARGUMENT;
    JointDescription read;
    const tandem_status status = read_joint(*joint, read);
    return status == TANDEM_OK ? self.told(self.world.add_joint(read, *place)) : status;
  });
}

/// Keeps the state of a world by its allocator.
template <typename Handle, typename State>
tandem_status save_state(const Handle* world, State** state) noexcept {
  if (state != nullptr) *state = nullptr;
  if (world == nullptr) return TANDEM_NULL_ARGUMENT;
  const Allocator& from = world->allocator;
  const tandem_allocator allocator = {sizeof allocator, 0, from.user, from.allocate, from.deallocate};
  return create(from.allocate != nullptr ? &allocator : nullptr, state,
                [&](State& made) { return world->number_of(world->world.save(made.state)); });
}

template <typename Handle, typename State>
tandem_status restore_state(Handle* world, const State* state) noexcept {
  return enter(world, [&](Handle& self) -> tandem_status {
    return state != nullptr ? self.told(self.world.restore(*state->state))
                            : tandem_status{TANDEM_NULL_ARGUMENT};
  });
}

}  // namespace tandem::c

/// Defines the functions that worlds of both kinds have in the same form. of: the handle. Of: its world.
#define TANDEM_WORLD_HANDLE(of, Of)                                                                       \
  void of##_destroy(of* world) {                                                                          \
    delete world;                                                                                         \
  }                                                                                                       \
  tandem_status of##_step(of* world, double dt, uint32_t steps) {                                         \
    return enter(world, [&](of& self) { return self.told(self.world.step(dt, steps)); });                 \
  }                                                                                                       \
  tandem_status of##_step_more(of* world, double dt, uint32_t steps) {                                    \
    return enter(world, [&](of& self) { return self.told(self.world.step_more(dt, steps)); });            \
  }                                                                                                       \
  double of##_time(const of* world) {                                                                     \
    return world != nullptr ? world->world.time() : 0;                                                    \
  }                                                                                                       \
  double of##_mass(const of* world, uint32_t body) {                                                      \
    return world != nullptr ? world->world.mass_of(body) : 0;                                             \
  }                                                                                                       \
  tandem_status of##_set_body(of* world, uint32_t body, const tandem_body_motion* motion) {               \
    return set_body(world, body, motion);                                                                 \
  }                                                                                                       \
  tandem_status of##_set_material(of* world, uint32_t body, double friction, double restitution,          \
                                  double rolling_resistance) {                                            \
    return enter(world, [&](of& self) {                                                                   \
      return self.told(self.world.set_material(body, {friction, restitution, rolling_resistance}));       \
    });                                                                                                   \
  }                                                                                                       \
  tandem_status of##_set_gravity_scale(of* world, uint32_t body, double gravity_scale) {                  \
    return enter(world,                                                                                   \
                 [&](of& self) { return self.told(self.world.set_gravity_scale(body, gravity_scale)); }); \
  }                                                                                                       \
  tandem_status of##_push(of* world, uint32_t body, const double* impulse, const double* at) {            \
    return call_with_two(world, &Of::push, body, impulse, at);                                            \
  }                                                                                                       \
  tandem_status of##_set_force(of* world, uint32_t body, const double* force, const double* torque) {     \
    return call_with_two(world, &Of::set_force, body, force, torque);                                     \
  }                                                                                                       \
  tandem_status of##_add_joint(of* world, const tandem_joint* joint, uint32_t* place) {                   \
    return add_joint(world, joint, place);                                                                \
  }                                                                                                       \
  tandem_status of##_remove_joint(of* world, uint32_t joint) {                                            \
    return enter(world, [&](of& self) { return self.told(self.world.remove_joint(joint)); });             \
  }                                                                                                       \
  tandem_status of##_set_motor(of* world, uint32_t joint, double speed, double most_effort) {             \
    return enter(world,                                                                                   \
                 [&](of& self) { return self.told(self.world.set_motor(joint, speed, most_effort)); });   \
  }                                                                                                       \
  tandem_status of##_save(const of* world, of##_state** state) {                                          \
    return save_state(world, state);                                                                      \
  }                                                                                                       \
  tandem_status of##_restore(of* world, const of##_state* state) {                                        \
    return restore_state(world, state);                                                                   \
  }                                                                                                       \
  void of##_state_destroy(of##_state* state) {                                                            \
    delete state;                                                                                         \
  }                                                                                                       \
  uint64_t of##_where(const of* world) {                                                                  \
    return world != nullptr ? world->where : 0;                                                           \
  }
