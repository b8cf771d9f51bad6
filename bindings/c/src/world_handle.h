#pragma once
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
  /// The interface's number of what the world returned. A handle that keeps more of an error hides it.
  tandem_status told(Status status) {
    return status == Status::kOk ? tandem_status{TANDEM_OK} : fail(to_c(status), world.where());
  }
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

}  // namespace tandem::c
