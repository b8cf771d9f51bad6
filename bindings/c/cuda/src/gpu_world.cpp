#include "tandem/dynamics/gpu_world.h"

#include <span>

#include "gpu_handles.h"
#include "world_handle.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_gpu_world : WorldHandle<GpuWorld> {
  // Keeps CUDA's error, too.
  tandem_status told(Status status) {
    (void)c::told(status, world.cuda_error());
    return WorldHandle::told(status);
  }
};

namespace {

// Copies rows from the GPU by a function of the world.
template <typename Row, typename Of>
tandem_status copy_rows(tandem_gpu_world* world, Status (GpuWorld::*get)(std::span<const Of>&),
                        const Row** rows, size_t* count) {
  if (rows != nullptr) *rows = nullptr;
  if (count != nullptr) *count = 0;
  return enter(world, [&](tandem_gpu_world& self) -> tandem_status {
    if (rows == nullptr) return TANDEM_NULL_ARGUMENT;
    std::span<const Of> found;
    const tandem_status status = self.told((self.world.*get)(found));
    if (status == TANDEM_OK) *rows = result<Row>(found, count);
    return status;
  });
}

}  // namespace

tandem_status tandem_gpu_world_create(const tandem_world_options* options, const tandem_allocator* allocator,
                                      tandem_gpu_world** world) {
  return create(allocator, world, [&](tandem_gpu_world& made) -> tandem_status {
    if (const tandem_status status = read_options(options, made.options); status != TANDEM_OK) return status;
    // A world on the CPU checks them without a GPU.
    return made.options.continuous ? tandem_status{TANDEM_BAD_OPTION}
                                   : to_c(World().set_bodies({}, made.options));
  });
}

void tandem_gpu_world_destroy(tandem_gpu_world* world) {
  delete world;
}

tandem_status tandem_gpu_world_set_assets(tandem_gpu_world* world, tandem_asset* const* assets, size_t count,
                                          tandem_stream stream) {
  return set_world_assets(world, assets, count,
                          [&](tandem_gpu_world& self, std::span<const AssetView> views) {
                            return self.world.set_assets(views, stream);
                          });
}

tandem_status tandem_gpu_world_set_bodies(tandem_gpu_world* world, const tandem_instance* instances,
                                          size_t count, const tandem_pair_filter* filter,
                                          const tandem_body_start* start) {
  return place_bodies(
      world, instances, count, filter, start, [](tandem_gpu_world& self, const GivenBodies& given) {
        return given.joints.empty() ? self.world.set_bodies(given.bodies, self.options, given.excluded)
                                    : Status::kBadOption;
      });
}

tandem_status tandem_gpu_world_step(tandem_gpu_world* world, double dt, uint32_t steps) {
  return enter(world, [&](tandem_gpu_world& self) { return self.told(self.world.step(dt, steps)); });
}

tandem_status tandem_gpu_world_bodies(tandem_gpu_world* world, const tandem_body_motion** bodies,
                                      size_t* count) {
  return copy_rows(world, &GpuWorld::bodies, bodies, count);
}

tandem_status tandem_gpu_world_contacts(tandem_gpu_world* world, const tandem_world_contact** contacts,
                                        size_t* count) {
  return copy_rows(world, &GpuWorld::contacts, contacts, count);
}

tandem_status tandem_gpu_world_touching(tandem_gpu_world* world, const tandem_object_pair** touching,
                                        size_t* count) {
  return copy_rows(world, &GpuWorld::touching, touching, count);
}

tandem_gpu_body_state* tandem_gpu_world_states(const tandem_gpu_world* world, size_t* count) {
  if (count != nullptr) *count = world != nullptr ? world->world.body_count() : 0;
  return world != nullptr ? reinterpret_cast<tandem_gpu_body_state*>(world->world.states()) : nullptr;
}

tandem_status tandem_gpu_world_wake(tandem_gpu_world* world) {
  return enter(world, [](tandem_gpu_world& self) { return self.told(self.world.wake()); });
}

tandem_status tandem_gpu_world_set_body(tandem_gpu_world* world, uint32_t body,
                                        const tandem_body_motion* motion) {
  return set_body(world, body, motion);
}

tandem_status tandem_gpu_world_push(tandem_gpu_world* world, uint32_t body, const double* impulse,
                                    const double* at) {
  return call_with_two(world, &GpuWorld::push, body, impulse, at);
}

tandem_status tandem_gpu_world_set_force(tandem_gpu_world* world, uint32_t body, const double* force,
                                         const double* torque) {
  return call_with_two(world, &GpuWorld::set_force, body, force, torque);
}

double tandem_gpu_world_time(const tandem_gpu_world* world) {
  return world != nullptr ? world->world.time() : 0;
}

double tandem_gpu_world_mass(const tandem_gpu_world* world, uint32_t body) {
  return world != nullptr ? world->world.mass_of(body) : 0;
}

uint64_t tandem_gpu_world_where(const tandem_gpu_world* world) {
  return world != nullptr ? world->where : 0;
}
