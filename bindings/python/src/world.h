#pragma once
#include <atomic>
#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include "core.h"

namespace tandem::python {

/// The options of tandem.World, as Python gives them. A number that is None has its default.
struct GivenOptions {
  nb::handle gravity, friction;
  double restitution;
  nb::handle slop, rolling_resistance;
  std::uint32_t substeps;
  bool sleeping, continuous;
  std::uint32_t threads;
};

/// Rows of `width` numbers for each of so many bodies, or none.
inline std::vector<double> numbers_of(nb::handle given, std::size_t bodies, std::size_t width) {
  if (given.is_none()) return {};
  std::vector<double> numbers = copy_rows<double>(given);
  if (numbers.size() != bodies * width) throw_broken_rows();
  return numbers;
}

/// One number of an option, or where there is None, its default, which is 0; the flag says that 0 is meant.
inline double option_of(nb::handle given, std::uint32_t& is_zero) {
  const double number = given.is_none() ? 0 : nb::cast<double>(given);
  is_zero = !given.is_none() && number == 0;
  return number;
}

inline tandem_world_options options_of(const GivenOptions& given) {
  auto options = sized<tandem_world_options>();
  options.no_gravity = 1;
  const std::vector<double> pull = numbers_of(given.gravity, 1, 3);
  for (std::size_t i = 0; i < pull.size(); ++i) {
    options.gravity[i] = pull[i];
    if (pull[i] != 0) options.no_gravity = 0;
  }
  options.friction = option_of(given.friction, options.no_friction);
  options.slop = option_of(given.slop, options.no_slop);
  options.rolling_resistance = option_of(given.rolling_resistance, options.no_rolling_resistance);
  options.restitution = given.restitution;
  options.substeps = given.substeps;
  options.no_sleeping = !given.sleeping;
  options.continuous = given.continuous;
  options.threads = given.threads;
  return options;
}

/// Names the types and functions of the C interface that worlds of both kinds have in the same form, as
/// static members of an Engine. of: the handle.
#define TANDEM_WORLD_ENGINE(of)                                     \
  using Handle = of;                                                \
  using StateHandle = of##_state;                                   \
  static constexpr auto create = of##_create;                       \
  static constexpr auto destroy = of##_destroy;                     \
  static constexpr auto set_bodies = of##_set_bodies;               \
  static constexpr auto step = of##_step;                           \
  static constexpr auto step_more = of##_step_more;                 \
  static constexpr auto set_body = of##_set_body;                   \
  static constexpr auto set_material = of##_set_material;           \
  static constexpr auto set_gravity_scale = of##_set_gravity_scale; \
  static constexpr auto push = of##_push;                           \
  static constexpr auto set_force = of##_set_force;                 \
  static constexpr auto add_joint = of##_add_joint;                 \
  static constexpr auto remove_joint = of##_remove_joint;           \
  static constexpr auto set_motor = of##_set_motor;                 \
  static constexpr auto save = of##_save;                           \
  static constexpr auto restore = of##_restore;                     \
  static constexpr auto state_destroy = of##_state_destroy;         \
  static constexpr auto time = of##_time;                           \
  static constexpr auto mass = of##_mass;                           \
  static constexpr auto where = of##_where

/// What a world was at some time. It keeps the engine, which says where it is.
template <typename Engine>
class WorldState {
 public:
  using Handle = typename Engine::StateHandle;

  WorldState(Handle* state, const Engine& engine)
      : state_(state, [engine](Handle* kept) {
          [[maybe_unused]] const auto here = engine.here();
          Engine::state_destroy(kept);
        }) {}
  const Handle* get() const { return state_.get(); }

 private:
  std::shared_ptr<Handle> state_;
};

/// A world of the C interface, on the CPU or on a GPU. Engine has the functions of its kind of world: those
/// of TANDEM_WORLD_ENGINE, and as static members
///   set_assets(world, assets, count), count(world);   the latter of bodies
///   bodies, contacts, touching, began, ended, joints, broken;   these return a tandem_status of (world,
///   &rows, &count)
/// and here(), not static, returns what lives during a call.
template <typename Engine>
class WorldOf {
 public:
  using Handle = typename Engine::Handle;
  using State = WorldState<Engine>;

  WorldOf(nb::list assets, const GivenOptions& options, Engine engine = {})
      : engine_(engine), assets_(std::move(assets)), options_(options_of(options)), world_(make()) {}

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
    const auto joined = copy_rows<tandem_joint>(joints);
    start.joints = joined.data(), start.joint_count = joined.size();
    // Somebody keeps the memory of the bodies before, which placing others would free.
    if (world_.use_count() > 1) world_ = make();
    ask([&](Handle* world) {
      return Engine::set_bodies(world, rows.data(), rows.size(), Filter::of(filter), &start);
    });
  }

  /// Looks for signals now and then, between steps.
  void step(double dt, std::uint64_t steps) {
    using Clock = std::chrono::steady_clock;
    const Turn turn = take_turn();
    std::uint64_t done = 0;
    do {
      ask([&](Handle* world) {
        const auto soon = Clock::now() + std::chrono::milliseconds(50);
        tandem_status status = TANDEM_OK;
        do {
          status = (done == 0 ? Engine::step : Engine::step_more)(world, dt, done < steps);
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
    ask([&](Handle* world) { return Engine::set_body(world, body, rows.data()); });
  }

  void set_material(std::uint32_t body, double friction, double restitution, double rolling_resistance) {
    const Turn turn = take_turn();
    ask([&](Handle* world) {
      return Engine::set_material(world, body, friction, restitution, rolling_resistance);
    });
  }
  void set_gravity_scale(std::uint32_t body, double scale) {
    const Turn turn = take_turn();
    ask([&](Handle* world) { return Engine::set_gravity_scale(world, body, scale); });
  }

  std::uint32_t add_joint(nb::handle joint) {
    const Turn turn = take_turn();
    const auto rows = copy_rows<tandem_joint>(joint);
    if (rows.size() != 1) throw_broken_rows();
    std::uint32_t place = 0;
    ask([&](Handle* world) { return Engine::add_joint(world, rows.data(), &place); });
    return place;
  }
  void remove_joint(std::uint32_t joint) {
    const Turn turn = take_turn();
    ask([&](Handle* world) { return Engine::remove_joint(world, joint); });
  }
  void set_motor(std::uint32_t joint, double speed, double most_effort) {
    const Turn turn = take_turn();
    ask([&](Handle* world) { return Engine::set_motor(world, joint, speed, most_effort); });
  }

  State save() {
    const Turn turn = take_turn();
    typename Engine::StateHandle* state = nullptr;
    ask([&](Handle* world) { return Engine::save(world, &state); });
    return {state, engine_};
  }
  void restore(const State& state) {
    const Turn turn = take_turn();
    ask([&](Handle* world) { return Engine::restore(world, state.get()); });
  }

  void push(std::uint32_t body, nb::handle impulse, nb::handle at) {
    with_two(Engine::push, body, impulse, at);
  }
  void set_force(std::uint32_t body, nb::handle force, nb::handle torque) {
    with_two(Engine::set_force, body, force, torque);
  }

  nb::object bodies() { return rows(Engine::bodies); }
  nb::object contacts() { return rows(Engine::contacts); }
  nb::object touching() { return rows(Engine::touching); }
  nb::object began() { return rows(Engine::began); }
  nb::object ended() { return rows(Engine::ended); }
  nb::object joints() { return rows(Engine::joints); }
  nb::object broken() { return rows(Engine::broken); }

  std::size_t count() {
    const Turn turn = take_turn();
    return Engine::count(world());
  }

  double time() {
    const Turn turn = take_turn();
    return Engine::time(world());
  }

  nb::object masses() {
    const Turn turn = take_turn();
    std::vector<double> masses(Engine::count(world()));
    for (std::size_t i = 0; i < masses.size(); ++i)
      masses[i] = Engine::mass(world(), static_cast<std::uint32_t>(i));
    return to_python(masses.data(), masses.size());
  }

 protected:
  Turn take_turn() { return Turn(busy_, "another thread is in a call of this world"); }
  Handle* world() const { return world_.get(); }
  /// Keeps the world, and the memory of its bodies.
  const std::shared_ptr<Handle>& keeper() const { return world_; }
  const Engine& engine() const { return engine_; }

  /// Makes a call of the C interface without the interpreter's lock.
  template <typename Call>
  void ask(const Call& call) {
    ask_of(world(), call);
  }

  /// A copy of rows, as a bytearray: NumPy makes an array of it that owns it.
  template <typename Row>
  nb::object rows(tandem_status (*get)(Handle*, const Row**, std::size_t*)) {
    const Turn turn = take_turn();
    const Row* first = nullptr;
    std::size_t count = 0;
    ask([&](Handle* world) { return get(world, &first, &count); });
    return to_python(first, count);
  }

 private:
  // Calls a function of one body and two vectors.
  template <typename Call>
  void with_two(const Call& call, std::uint32_t body, nb::handle first, nb::handle second) {
    const Turn turn = take_turn();
    const std::vector<double> p = numbers_of(first, 1, 3), q = numbers_of(second, 1, 3);
    ask([&](Handle* world) { return call(world, body, p.data(), q.data()); });
  }

  template <typename Call>
  void ask_of(Handle* world, const Call& call) {
    const tandem_status status = [&] {
      const WithoutLock other_threads_run;
      [[maybe_unused]] const auto here = engine_.here();
      return call(world);
    }();
    if (status != TANDEM_OK) check(status, Engine::where(world));
  }

  // Makes a world without bodies.
  std::shared_ptr<Handle> make() {
    Handle* made = nullptr;
    check(Engine::create(&options_, nullptr, &made));
    const std::shared_ptr<Handle> kept(made, [engine = engine_](Handle* world) {
      [[maybe_unused]] const auto here = engine.here();
      Engine::destroy(world);
    });
    std::vector<tandem_asset*> list;
    for (nb::handle asset : assets_) list.push_back(nb::cast<const Asset&>(asset).get());
    ask_of(made, [&](Handle* world) { return Engine::set_assets(world, list.data(), list.size()); });
    return kept;
  }

  Engine engine_;
  nb::list assets_;
  tandem_world_options options_;
  std::shared_ptr<Handle> world_;
  std::atomic<bool> busy_ = false;
};

/// Adds the class World to a module, with what worlds of all kinds have. Of: derived of WorldOf, and made of
/// assets, GivenOptions and Place...
template <typename Of, typename... Place>
nb::class_<Of> add_world(nb::module_& module) {
  nb::class_<typename Of::State>(module, "WorldState");
  const auto none = [] { return nb::arg().none(); };
  nb::class_<Of> made(module, "World");
  made.def(
          "__init__",
          [](Of* self, nb::list assets, nb::handle gravity, nb::handle friction, double restitution,
             nb::handle slop, nb::handle rolling_resistance, std::uint32_t substeps, bool sleeping,
             bool continuous, std::uint32_t threads, Place... place) {
            new (self) Of(assets,
                          {gravity, friction, restitution, slop, rolling_resistance, substeps, sleeping,
                           continuous, threads},
                          place...);
          },
          nb::arg(), nb::arg(), nb::arg(), nb::arg(), none(), none(), nb::arg(), nb::arg(), nb::arg(),
          nb::arg(), (static_cast<void>(sizeof(Place)), nb::arg())...)
      .def("set_bodies", &Of::set_bodies, nb::arg(), none(), none(), none(), none(), none(), none(), none(),
           none(), nb::arg())
      .def("step", &Of::step)
      .def("set_body", &Of::set_body)
      .def("set_material", &Of::set_material)
      .def("set_gravity_scale", &Of::set_gravity_scale)
      .def("push", &Of::push)
      .def("set_force", &Of::set_force)
      .def("bodies", &Of::bodies)
      .def("contacts", &Of::contacts)
      .def("touching", &Of::touching)
      .def("began", &Of::began)
      .def("ended", &Of::ended)
      .def("joints", &Of::joints)
      .def("broken", &Of::broken)
      .def("add_joint", &Of::add_joint)
      .def("remove_joint", &Of::remove_joint)
      .def("set_motor", &Of::set_motor)
      .def("save", &Of::save)
      .def("restore", &Of::restore)
      .def("count", &Of::count)
      .def("time", &Of::time)
      .def("masses", &Of::masses);
  return made;
}

}  // namespace tandem::python
