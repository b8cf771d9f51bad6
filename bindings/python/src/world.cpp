#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "core.h"
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

// One number of an option, or where there is None, its default, which is 0; the flag says that 0 is meant.
double option_of(nb::handle given, std::uint32_t& is_zero) {
  const double number = given.is_none() ? 0 : nb::cast<double>(given);
  is_zero = !given.is_none() && number == 0;
  return number;
}

// Rows of `width` numbers for each of so many bodies, or none.
std::vector<double> numbers_of(nb::handle given, std::size_t bodies, std::size_t width) {
  if (given.is_none()) return {};
  std::vector<double> numbers = copy_rows<double>(given);
  if (numbers.size() != bodies * width) throw_broken_rows();
  return numbers;
}

class World {
 public:
  World(nb::list assets, nb::handle gravity, nb::handle friction, double restitution, nb::handle slop,
        nb::handle rolling_resistance, std::uint32_t substeps, bool sleeping, bool continuous,
        std::uint32_t threads) {
    std::vector<tandem_asset*> list;
    for (nb::handle asset : assets) list.push_back(nb::cast<const Asset&>(asset).get());
    auto options = sized<tandem_world_options>();
    options.no_gravity = 1;
    const std::vector<double> pull = numbers_of(gravity, 1, 3);
    for (std::size_t i = 0; i < pull.size(); ++i) {
      options.gravity[i] = pull[i];
      if (pull[i] != 0) options.no_gravity = 0;
    }
    options.friction = option_of(friction, options.no_friction);
    options.slop = option_of(slop, options.no_slop);
    options.rolling_resistance = option_of(rolling_resistance, options.no_rolling_resistance);
    options.restitution = restitution;
    options.substeps = substeps;
    options.no_sleeping = !sleeping;
    options.continuous = continuous;
    options.threads = threads;
    tandem_world* made = nullptr;
    check(tandem_world_create(&options, nullptr, &made));
    world_.reset(made);
    ask([&](tandem_world* world) { return tandem_world_set_assets(world, list.data(), list.size()); });
  }

  void set_bodies(nb::handle instances, const Filter* filter, nb::handle density, nb::handle velocity,
                  nb::handle angular_velocity, nb::handle friction, nb::handle restitution,
                  nb::handle rolling_resistance, nb::handle gravity_scale, nb::handle joints) {
    const Turn turn = take_turn();
    const auto rows = copy_rows<tandem_instance>(instances);
    auto start = sized<tandem_body_start>();
    start.count = rows.size();
    std::vector<std::vector<double>> numbers;
    const auto take = [&](nb::handle given, std::size_t width, const double*& row) {
      numbers.push_back(numbers_of(given, rows.size(), width));
      if (!numbers.back().empty()) row = numbers.back().data();
    };
    take(density, 1, start.density);
    take(velocity, 3, start.velocity);
    take(angular_velocity, 3, start.angular_velocity);
    take(friction, 1, start.friction);
    take(restitution, 1, start.restitution);
    take(rolling_resistance, 1, start.rolling_resistance);
    take(gravity_scale, 1, start.gravity_scale);
    forget_call();
    const auto joined = copy_rows<tandem_joint>(joints);
    start.joints = joined.data(), start.joint_count = joined.size();
    ask([&](tandem_world* world) {
      return tandem_world_set_bodies(world, rows.data(), rows.size(), Filter::of(filter), &start);
    });
  }

  // Looks for signals now and then, between steps.
  void step(double dt, std::uint64_t steps) {
    using Clock = std::chrono::steady_clock;
    const Turn turn = take_turn();
    std::uint64_t done = 0;
    forget_call();
    do {
      ask([&](tandem_world* world) {
        const auto soon = Clock::now() + std::chrono::milliseconds(50);
        tandem_status status = TANDEM_OK;
        do {
          status = tandem_world_step(world, dt, done < steps);
          take_changes();
        } while (status == TANDEM_OK && ++done < steps && Clock::now() < soon);
        return status;
      });
      if (PyErr_CheckSignals() != 0) throw nb::python_error();
    } while (done < steps);
  }

  void set_body(std::uint32_t body, nb::handle motion) {
    const Turn turn = take_turn();
    const auto rows = copy_rows<tandem_body_motion>(motion);
    if (rows.size() != 1) throw_broken_rows();
    ask([&](tandem_world* world) { return tandem_world_set_body(world, body, rows.data()); });
  }

  // Calls a function of one body and two vectors.
  template <auto call>
  void with_two(std::uint32_t body, nb::handle first, nb::handle second) {
    const Turn turn = take_turn();
    const std::vector<double> p = numbers_of(first, 1, 3), q = numbers_of(second, 1, 3);
    ask([&](tandem_world* world) { return call(world, body, p.data(), q.data()); });
  }

  nb::object bodies() { return rows<tandem_world_bodies>(); }
  nb::object contacts() { return rows<tandem_world_contacts>(); }
  nb::object touching() { return rows<tandem_world_touching>(); }
  nb::object began() { return copy_of(began_); }
  nb::object ended() { return copy_of(ended_); }
  nb::object broken() { return copy_of(broken_); }
  nb::object joints() { return rows<tandem_world_joints>(); }

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

  std::size_t count() {
    const Turn turn = take_turn();
    return body_count();
  }

  double time() {
    const Turn turn = take_turn();
    return tandem_world_time(world_.get());
  }

  nb::object masses() {
    const Turn turn = take_turn();
    std::vector<double> masses(body_count());
    for (std::size_t i = 0; i < masses.size(); ++i)
      masses[i] = tandem_world_mass(world_.get(), static_cast<std::uint32_t>(i));
    return to_python(masses.data(), masses.size());
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
  Turn take_turn() { return Turn(busy_, "another thread is in a call of this world"); }

  std::size_t body_count() const {
    std::size_t bodies;
    tandem_world_bodies(world_.get(), &bodies);
    return bodies;
  }

  // Makes a call of the C interface without the interpreter's lock.
  template <typename Call>
  void ask(const Call& call) {
    tandem_world* const world = world_.get();
    const tandem_status status = [&] {
      const WithoutLock other_threads_run;
      return call(world);
    }();
    if (status != TANDEM_OK) check(status, tandem_world_where(world));
  }

  // A copy of rows, as a bytearray: NumPy makes an array of it that owns it.
  template <auto get>
  nb::object rows() {
    const Turn turn = take_turn();
    std::size_t count;
    const auto* first = get(world_.get(), &count);
    return to_python(first, count);
  }

  template <typename Row>
  nb::object copy_of(const std::vector<Row>& rows) {
    const Turn turn = take_turn();
    return to_python(rows.data(), rows.size());
  }

  void forget_call() { began_.clear(), ended_.clear(), broken_.clear(); }

  // Adds what a step changed to the lists of the call.
  void take_changes() {
    const auto told = [&](auto get) {
      std::size_t count;
      const auto* first = get(world_.get(), &count);
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
  std::unique_ptr<tandem_world, decltype(&tandem_world_destroy)> world_{nullptr, tandem_world_destroy};
  std::atomic<bool> busy_ = false;
};

}  // namespace

void add_worlds(nb::module_& module) {
  const auto none = [] { return nb::arg().none(); };
  nb::class_<WorldState>(module, "WorldState");
  nb::class_<World>(module, "World")
      .def(nb::init<nb::list, nb::handle, nb::handle, double, nb::handle, nb::handle, std::uint32_t, bool,
                    bool, std::uint32_t>(),
           nb::arg(), nb::arg(), nb::arg(), nb::arg(), none(), none(), nb::arg(), nb::arg(), nb::arg(),
           nb::arg())
      .def("set_bodies", &World::set_bodies, nb::arg(), none(), none(), none(), none(), none(), none(),
           none(), none(), nb::arg())
      .def("step", &World::step)
      .def("set_body", &World::set_body)
      .def("push", &World::with_two<tandem_world_push>)
      .def("set_force", &World::with_two<tandem_world_set_force>)
      .def("bodies", &World::bodies)
      .def("contacts", &World::contacts)
      .def("touching", &World::touching)
      .def("began", &World::began)
      .def("ended", &World::ended)
      .def("broken", &World::broken)
      .def("joints", &World::joints)
      .def("add_joint", &World::add_joint)
      .def("remove_joint", &World::remove_joint)
      .def("set_material", &World::set_material)
      .def("set_gravity_scale", &World::set_gravity_scale)
      .def("set_motor", &World::set_motor)
      .def("count", &World::count)
      .def("time", &World::time)
      .def("masses", &World::masses)
      .def("save", &World::save)
      .def("restore", &World::restore);
}

}  // namespace tandem::python
