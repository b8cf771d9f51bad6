#include "world.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <span>

#include "dynamics/lists_of_steps.h"

namespace tandem::python {
namespace {

// What a world was at some time.
class WorldState {
 public:
  explicit WorldState(tandem_world_state* state) : state_(state, tandem_world_state_destroy) {}
  const tandem_world_state* get() const { return state_.get(); }

 private:
  std::unique_ptr<tandem_world_state, decltype(&tandem_world_state_destroy)> state_;
};

// A function of the C interface that returns rows, as one that returns whether there are any.
template <auto get>
tandem_status rows_of(tandem_world* world, decltype(get(nullptr, nullptr))* rows, std::size_t* count) {
  *rows = get(world, count);
  return TANDEM_OK;
}

struct OnCpu {
  using Handle = tandem_world;
  static constexpr auto create = tandem_world_create;
  static constexpr auto destroy = tandem_world_destroy;
  static constexpr auto set_assets = tandem_world_set_assets;
  static constexpr auto set_bodies = tandem_world_set_bodies;
  static constexpr auto step = tandem_world_step;
  static constexpr auto bodies = rows_of<tandem_world_bodies>;
  static constexpr auto contacts = rows_of<tandem_world_contacts>;
  static constexpr auto touching = rows_of<tandem_world_touching>;
  static constexpr auto set_body = tandem_world_set_body;
  static constexpr auto push = tandem_world_push;
  static constexpr auto set_force = tandem_world_set_force;
  static constexpr auto time = tandem_world_time;
  static constexpr auto mass = tandem_world_mass;
  static constexpr auto where = tandem_world_where;

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

  nb::object began() { return copy_of(began_); }
  nb::object ended() { return copy_of(ended_); }
  nb::object broken() { return copy_of(broken_); }
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

  void set_material(std::uint32_t body, double friction, double restitution, double rolling_resistance) {
    const Turn turn = take_turn();
    ask([&](tandem_world* world) {
      return tandem_world_set_material(world, body, friction, restitution, rolling_resistance);
    });
  }

  void set_gravity_scale(std::uint32_t body, double scale) {
    const Turn turn = take_turn();
    ask([&](tandem_world* world) { return tandem_world_set_gravity_scale(world, body, scale); });
  }

  void set_motor(std::uint32_t joint, double speed, double most_effort) {
    const Turn turn = take_turn();
    ask([&](tandem_world* world) { return tandem_world_set_motor(world, joint, speed, most_effort); });
  }

  WorldState save() {
    const Turn turn = take_turn();
    tandem_world_state* state = nullptr;
    ask([&](tandem_world* world) { return tandem_world_save(world, &state); });
    return WorldState(state);
  }

  void restore(const WorldState& state) {
    const Turn turn = take_turn();
    forget_call();
    ask([&](tandem_world* world) { return tandem_world_restore(world, state.get()); });
  }

 private:
  template <typename Row>
  nb::object copy_of(const std::vector<Row>& rows) {
    const Turn turn = take_turn();
    return to_python(rows.data(), rows.size());
  }

  void forget_call() override { began_.clear(), ended_.clear(), broken_.clear(); }

  // Adds what a step changed to the lists of the call.
  void take_changes() override {
    const auto told = [&](auto get) {
      std::size_t count;
      const auto* first = get(world(), &count);
      return std::span(first, count);
    };
    dynamics::add_touches(told(tandem_world_began), told(tandem_world_touching), began_);
    dynamics::add_pairs(told(tandem_world_ended), ended_);
    std::ranges::copy(told(tandem_world_broken), std::back_inserter(broken_));
    std::ranges::sort(broken_);
  }

  // In the last call of step():
  std::vector<tandem_world_touch> began_;
  std::vector<tandem_object_pair> ended_;
  std::vector<std::uint32_t> broken_;
};

}  // namespace

void add_worlds(nb::module_& module) {
  nb::class_<WorldState>(module, "WorldState");
  add_world<World>(module)
      .def("began", &World::began)
      .def("ended", &World::ended)
      .def("broken", &World::broken)
      .def("joints", &World::joints)
      .def("add_joint", &World::add_joint)
      .def("remove_joint", &World::remove_joint)
      .def("set_material", &World::set_material)
      .def("set_gravity_scale", &World::set_gravity_scale)
      .def("set_motor", &World::set_motor)
      .def("save", &World::save)
      .def("restore", &World::restore);
}

}  // namespace tandem::python
