#include "tandem/dynamics/world.h"

#include <span>

#include "world_handle.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_world : WorldHandle<World> {};

struct tandem_world_state : WorldStateHandle<World> {};

TANDEM_WORLD_HANDLE(tandem_world, World)

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
