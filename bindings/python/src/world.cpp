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

  static std::size_t count(const tandem_world* world) {
    std::size_t bodies;
    tandem_world_bodies(world, &bodies);
    return bodies;
  }
  static std::nullptr_t here() { return nullptr; }
};

class World : public WorldOf<OnCpu> {
 public:
  using WorldOf::WorldOf;

  nb::object broken() { return rows(rows_of<tandem_world_broken>); }
  nb::object joints() { return rows(rows_of<tandem_world_joints>); }

  std::uint32_t add_joint(nb::handle joint) {
    const Turn turn = take_turn();
    const auto rows = copy_rows<tandem_joint>(joint);
    if (rows.size() != 1) throw_broken_rows();
    std::uint32_t place = 0;
    ask([&](tandem_world* world) { return tandem_world_add_joint(world, rows.data(), &place); });
    return place;
  }

  void remove_joint(std::uint32_t joint) {
    const Turn turn = take_turn();
    ask([&](tandem_world* world) { return tandem_world_remove_joint(world, joint); });
  }

  void set_motor(std::uint32_t joint, double speed, double most_effort) {
    const Turn turn = take_turn();
    ask([&](tandem_world* world) { return tandem_world_set_motor(world, joint, speed, most_effort); });
  }
};

}  // namespace

void add_worlds(nb::module_& module) {
  add_world<World>(module)
      .def("broken", &World::broken)
      .def("joints", &World::joints)
      .def("add_joint", &World::add_joint)
      .def("remove_joint", &World::remove_joint)
      .def("set_motor", &World::set_motor);
}

}  // namespace tandem::python
