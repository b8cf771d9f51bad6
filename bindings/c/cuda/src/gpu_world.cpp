#include "tandem/dynamics/gpu_world.h"

#include <span>

#include "gpu_handles.h"
#include "world_handle.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_gpu_world : WorldHandle<GpuWorld> {
  // Keeps CUDA's error, too.
  tandem_status number_of(Status status) const { return c::told(status, world.cuda_error()); }
  tandem_status told(Status status) {
    (void)number_of(status);
    return WorldHandle::told(status);
  }
};

struct tandem_gpu_world_state : WorldStateHandle<GpuWorld> {};

TANDEM_WORLD_HANDLE(tandem_gpu_world, GpuWorld)

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
    return to_c(World().set_bodies({}, made.options));
  });
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
        return self.world.set_bodies(given.bodies, self.options, given.excluded, given.joints);
      });
}

// Defines the function that copies rows of a kind.
#define TANDEM_GPU_WORLD_ROWS(name, row)                                                            \
  tandem_status tandem_gpu_world_##name(tandem_gpu_world* world, const row** rows, size_t* count) { \
    return copy_rows(world, &GpuWorld::name, rows, count);                                          \
  }

TANDEM_GPU_WORLD_ROWS(bodies, tandem_body_motion)
TANDEM_GPU_WORLD_ROWS(contacts, tandem_world_contact)
TANDEM_GPU_WORLD_ROWS(touching, tandem_world_touch)
TANDEM_GPU_WORLD_ROWS(began, tandem_world_touch)
TANDEM_GPU_WORLD_ROWS(ended, tandem_object_pair)
TANDEM_GPU_WORLD_ROWS(joints, tandem_world_joint)
TANDEM_GPU_WORLD_ROWS(broken, uint32_t)

tandem_gpu_body_state* tandem_gpu_world_states(const tandem_gpu_world* world, size_t* count) {
  if (count != nullptr) *count = world != nullptr ? world->world.body_count() : 0;
  return world != nullptr ? reinterpret_cast<tandem_gpu_body_state*>(world->world.states()) : nullptr;
}

tandem_status tandem_gpu_world_wake(tandem_gpu_world* world) {
  return enter(world, [](tandem_gpu_world& self) { return self.told(self.world.wake()); });
}

size_t tandem_gpu_world_bytes(const tandem_gpu_world* world) {
  return world != nullptr ? world->world.bytes() : 0;
}
