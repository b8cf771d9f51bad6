#include "world.h"

#include <cstddef>

namespace tandem::python {
namespace {

// A function of the C interface that returns rows, as one that returns whether there are any.
template <auto get>
tandem_status rows_of(tandem_world* world, decltype(get(nullptr, nullptr))* rows, std::size_t* count) {
  *rows = get(world, count);
  return TANDEM_OK;
}

struct OnCpu {
  TANDEM_WORLD_ENGINE(tandem_world);
  static constexpr auto set_assets = tandem_world_set_assets;
  static constexpr auto bodies = rows_of<tandem_world_bodies>;
  static constexpr auto contacts = rows_of<tandem_world_contacts>;
  static constexpr auto touching = rows_of<tandem_world_touching>;
  static constexpr auto began = rows_of<tandem_world_began>;
  static constexpr auto ended = rows_of<tandem_world_ended>;
  static constexpr auto joints = rows_of<tandem_world_joints>;
  static constexpr auto broken = rows_of<tandem_world_broken>;

  static std::size_t count(const tandem_world* world) {
    std::size_t bodies;
    tandem_world_bodies(world, &bodies);
    return bodies;
  }
  static std::nullptr_t here() { return nullptr; }
};

}  // namespace

void add_worlds(nb::module_& module) {
  add_world<WorldOf<OnCpu>>(module);
}

}  // namespace tandem::python
