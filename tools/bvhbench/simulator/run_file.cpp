#include "run_file.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <type_traits>
#include <utility>

#include "bvhbench/scenes/columns.h"

namespace tandem::bench {

template <>
struct Stored<dynamics::Vector3> {
  using Number = double;
  static constexpr std::size_t kWidth = 3;
  static void append(std::vector<double>& numbers, const dynamics::Vector3& vector) {
    numbers.insert(numbers.end(), {vector.x, vector.y, vector.z});
  }
  static dynamics::Vector3 at(const std::vector<double>& numbers, std::size_t i) {
    return {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  }
};

template <>
struct Stored<dynamics::Quaternion> {
  using Number = double;
  static constexpr std::size_t kWidth = 4;
  static void append(std::vector<double>& numbers, const dynamics::Quaternion& turn) {
    numbers.insert(numbers.end(), {turn.w, turn.x, turn.y, turn.z});
  }
  static dynamics::Quaternion at(const std::vector<double>& numbers, std::size_t i) {
    return {numbers[4 * i], numbers[4 * i + 1], numbers[4 * i + 2], numbers[4 * i + 3]};
  }
};

/// The rotation row by row, then the translation.
template <>
struct Stored<Pose> {
  using Number = double;
  static constexpr std::size_t kWidth = 12;
  static void append(std::vector<double>& numbers, const Pose& pose) {
    for (const auto& row : pose.rotation) numbers.insert(numbers.end(), row, row + 3);
    numbers.insert(numbers.end(), pose.translation, pose.translation + 3);
  }
  static Pose at(const std::vector<double>& numbers, std::size_t i) {
    Pose pose;
    const double* next = &numbers[kWidth * i];
    for (auto& row : pose.rotation) std::copy_n(next, 3, row), next += 3;
    std::copy_n(next, 3, pose.translation);
    return pose;
  }
};

}  // namespace tandem::bench

namespace tandem::simulation {
namespace {

using bench::FileError;
using bench::Hdf5Input;
using bench::Hdf5Output;
using bench::Stored;

constexpr const char* kFrames = "/frames";

// Calls visit(name, member) for each dataset of a kind of row, by its name in the folder of such rows. It has
// one row for each element.
template <typename Visit>
void for_each_column(const StepRecord&, const Visit& visit) {
  visit("time", &StepRecord::time);
  visit("seconds/update", &StepRecord::update);
  visit("seconds/broad_phase", &StepRecord::broad_phase);
  visit("seconds/traversal", &StepRecord::traversal);
  visit("seconds/triangle_tests", &StepRecord::triangle_tests);
  visit("seconds/transfer", &StepRecord::transfer);
  visit("seconds/contacts", &StepRecord::generation);
  visit("seconds/solver", &StepRecord::solver_seconds);
  visit("seconds/step", &StepRecord::step_seconds);
  visit("object_pairs", &StepRecord::object_pairs);
  visit("kept_pairs", &StepRecord::kept_pairs);
  visit("block_pairs", &StepRecord::block_pairs);
  visit("candidates", &StepRecord::candidates);
  visit("triangle_pairs", &StepRecord::triangle_pairs);
  visit("segments", &StepRecord::segments);
  visit("patches", &StepRecord::patches);
  visit("open_curves", &StepRecord::open_curves);
  visit("contacts", &StepRecord::contacts);
  visit("islands", &StepRecord::islands);
  visit("newton_islands", &StepRecord::newton_islands);
  visit("sleeping", &StepRecord::sleeping);
  visit("reentered", &StepRecord::reentered);
  visit("contact_ratio", &StepRecord::contact_ratio);
  visit("contact_area", &StepRecord::contact_area);
  visit("penetration_max", &StepRecord::penetration_max);
  visit("penetration_mean", &StepRecord::penetration_mean);
  visit("residual_max", &StepRecord::residual_max);
  visit("residual_rms", &StepRecord::residual_rms);
  visit("kinetic_energy", &StepRecord::kinetic_energy);
  visit("potential_energy", &StepRecord::potential_energy);
  visit("linear_momentum", &StepRecord::linear_momentum);
  visit("angular_momentum", &StepRecord::angular_momentum);
  visit("speed_max", &StepRecord::speed_max);
  visit("speed_mean", &StepRecord::speed_mean);
  visit("spin_max", &StepRecord::spin_max);
}

template <typename Visit>
void for_each_column(const BodyState&, const Visit& visit) {
  visit("position", &BodyState::position);
  visit("orientation", &BodyState::orientation);
  visit("velocity", &BodyState::velocity);
  visit("angular_velocity", &BodyState::angular_velocity);
}

template <typename Visit>
void for_each_column(const CachedContact&, const Visit& visit) {
  visit("pair", &CachedContact::pair);
  visit("feature", &CachedContact::feature);
  visit(
      "in_a", [](auto& c) -> auto& { return c.anchor.in_a; });
  visit(
      "in_b", [](auto& c) -> auto& { return c.anchor.in_b; });
  visit("normal_in_a", &CachedContact::normal_in_a);
  visit(
      "depth", [](auto& c) -> auto& { return c.anchor.depth; });
  visit("quiet_steps", &CachedContact::quiet_steps);
  visit(
      "normal_impulse", [](auto& c) -> auto& { return c.impulse.normal; });
  visit(
      "tangential_impulse", [](auto& c) -> auto& { return c.impulse.tangential; });
  visit(
      "turning_impulse", [](auto& c) -> auto& { return c.impulse.turning; });
}

template <typename Visit>
void for_each_column(const PosedBodies&, const Visit& visit) {
  visit("pair", &PosedBodies::pair);
  visit(
      "shape_a", [](auto& posed) -> auto& { return posed.a.asset; });
  visit(
      "shape_b", [](auto& posed) -> auto& { return posed.b.asset; });
  visit(
      "pose_a", [](auto& posed) -> auto& { return posed.a.pose; });
  visit(
      "pose_b", [](auto& posed) -> auto& { return posed.b.pose; });
}

template <typename Visit>
void for_each_column(const PairApart&, const Visit& visit) {
  visit("pair", &PairApart::pair);
  visit("distance", &PairApart::distance);
}

template <typename Row>
void write_rows(Hdf5Output& file, const std::string& folder, const std::vector<Row>& rows) {
  for_each_column(Row(), [&](const char* name, auto member) {
    add_column(file, folder + "/" + name, std::span(rows), member);
  });
}

// Reads rows, as many as the first dataset has. Result: whether all have as many.
template <typename Row>
bool read_rows(const Hdf5Input& file, const std::string& folder, std::vector<Row>& rows) {
  bool first = true, alike = true;
  for_each_column(Row(), [&](const char* name, auto member) {
    using Value = std::decay_t<decltype(std::invoke(member, rows[0]))>;
    const auto values = bench::read_values<Value>(file, folder + "/" + name);
    alike = alike && (first || values.size() == rows.size());
    if (std::exchange(first, false)) rows.resize(values.size());
    for (std::size_t i = 0; i < std::min(rows.size(), values.size()); ++i)
      std::invoke(member, rows[i]) = values[i];
  });
  return alike;
}

// Refuses numbers that are not finite, by dataset and row.
template <typename Row>
void require_finite(const std::string& path, const std::string& folder, const std::vector<Row>& rows) {
  for_each_column(Row(), [&](const char* name, auto member) {
    const auto numbers = bench::column(std::span(rows), member);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (std::isfinite(static_cast<double>(numbers[i]))) continue;
      const std::size_t row = i / (numbers.size() / rows.size());
      throw FileError(path + ": " + folder + "/" + name + ": row " + std::to_string(row) +
                      ": a number is not finite");
    }
  });
}

void write_bodies(Hdf5Output& file, const RunDescription& run) {
  const std::span<const BodyProperties> bodies = run.bodies;
  const auto asset = [&](const BodyProperties& body) { return run.shapes[body.shape].asset; };
  const auto level = [&](const BodyProperties& body) { return run.shapes[body.shape].level; };
  const auto motion = [](const BodyProperties& body) { return static_cast<std::uint32_t>(body.motion); };
  const auto mass = [](const BodyProperties& body) { return body.motion == Motion::moving ? body.mass : 0; };
  file.add("/assets", run.assets);
  add_column(file, "/bodies/asset", bodies, asset);
  if (std::any_of(bodies.begin(), bodies.end(), level)) add_column(file, "/bodies/level", bodies, level);
  add_column(file, "/bodies/motion", bodies, motion);
  add_column(file, "/bodies/mass", bodies, mass);
  add_column(file, "/bodies/density", bodies, &BodyProperties::density);
  add_column(file, "/bodies/centre_of_mass", bodies, &BodyProperties::centre);
  std::vector<double> inertia;
  for (const BodyProperties& body : bodies)
    for (const Vector3& row : body.inertia.row) Stored<Vector3>::append(inertia, row);
  file.add("/bodies/inertia", {bodies.size(), 3, 3}, inertia);
}

void write_trajectory(Hdf5Output& file, const Trajectory& trajectory, std::size_t bodies) {
  if (trajectory.every == 0) return;
  const std::size_t kept = trajectory.frame.size();
  file.add("/trajectory/frame", {kept}, trajectory.frame);
  file.add("/trajectory/position", {kept, bodies, 3}, trajectory.position);
  file.add("/trajectory/orientation", {kept, bodies, 4}, trajectory.orientation);
  file.add("/trajectory/velocity", {kept, bodies, 3}, trajectory.velocity);
  file.add("/trajectory/angular_velocity", {kept, bodies, 3}, trajectory.angular_velocity);
}

Trajectory read_trajectory(const Hdf5Input& file, const std::string& path, std::size_t bodies) {
  Trajectory trajectory;
  trajectory.frame = file.read_u32("/trajectory/frame");
  trajectory.position = file.read_f64("/trajectory/position", {bodies, 3});
  trajectory.orientation = file.read_f64("/trajectory/orientation", {bodies, 4});
  trajectory.velocity = file.read_f64("/trajectory/velocity", {bodies, 3});
  trajectory.angular_velocity = file.read_f64("/trajectory/angular_velocity", {bodies, 3});
  const std::size_t states = trajectory.frame.size() * bodies;
  if (trajectory.position.size() != 3 * states || trajectory.orientation.size() != 4 * states ||
      trajectory.velocity.size() != 3 * states || trajectory.angular_velocity.size() != 3 * states) {
    throw FileError(path + ": /trajectory: not of " + std::to_string(trajectory.frame.size()) + " frames");
  }
  return trajectory;
}

// The folders of a state's rows.
constexpr const char *kBodies = "/state", *kContacts = "/state/contacts", *kPosed = "/state/pairs",
                     *kBefore = "/state/before", *kApart = "/state/apart";

void write_state(Hdf5Output& file, const SimulationState& state) {
  const std::size_t bodies = state.states.size();
  const std::vector<std::uint64_t> step = {state.step};
  file.add("/state/step", {1}, step);
  write_rows(file, kBodies, state.states);
  file.add("/state/quiet_seconds", {bodies}, state.quiet);
  file.add("/state/sleeping_group", {bodies}, state.groups);
  write_rows(file, kContacts, state.contacts);
  write_rows(file, kPosed, state.posed);
  write_rows(file, kBefore, state.ahead.before);
  write_rows(file, kApart, state.ahead.apart);
}

SimulationState read_state(const Hdf5Input& file, const std::string& path, std::size_t bodies) {
  SimulationState state;
  const bool alike = read_rows(file, kBodies, state.states) && read_rows(file, kBefore, state.ahead.before);
  const auto step = file.read_u64("/state/step");
  state.quiet = file.read_f64("/state/quiet_seconds");
  state.groups = file.read_u32("/state/sleeping_group");
  const auto read_pairs = [&](const char* folder, auto& rows) {
    if (!read_rows(file, folder, rows))
      throw FileError(path + ": " + folder + ": datasets of different lengths");
    for (const auto& row : rows) {
      if (row.pair.a >= row.pair.b || row.pair.b >= bodies)
        throw FileError(path + ": " + folder + "/pair: not two bodies of the run, the lower first");
    }
    if (!std::ranges::is_sorted(rows, {}, [](const auto& row) { return row.pair; }))
      throw FileError(path + ": " + folder + "/pair: not ascending");
    require_finite(path, folder, rows);
  };
  read_pairs(kContacts, state.contacts);
  read_pairs(kPosed, state.posed);
  read_pairs(kApart, state.ahead.apart);
  const std::size_t before = state.ahead.before.size();  // none where no contacts ahead are looked for
  const bool fits = alike && step.size() == 1 && state.states.size() == bodies &&
                    (before == bodies || before == 0) && state.quiet.size() == bodies &&
                    state.groups.size() == bodies;
  if (!fits) throw FileError(path + ": /state: not of " + std::to_string(bodies) + " bodies");
  require_finite(path, kBodies, state.states);
  require_finite(path, kBefore, state.ahead.before);
  state.step = step[0];
  return state;
}

void write_options(Hdf5Output& file, const Json& options) {
  file.attribute("tandem_version", TANDEM_VERSION);
  file.attribute("options", options.dump());
  for (const auto& [name, value] : options.items()) {
    if (value.is_number_integer()) {
      file.attribute(name, value.get<std::uint64_t>());
    } else if (value.is_number()) {
      file.attribute(name, value.get<double>());
    } else {
      file.attribute(name, value.is_string() ? value.get<std::string>() : value.dump());
    }
  }
}

// The run of the file must be the one that is asked for.
void check_options(const Hdf5Input& file, const std::string& path, const Json& expected) {
  const Json stored = Json::parse(file.read_attribute("options"), nullptr, false);
  if (stored == expected) return;
  for (const auto& [name, value] : expected.items()) {
    if (stored.is_object() && stored.contains(name) && stored[name] == value) continue;
    const std::string found = stored.is_object() && stored.contains(name) ? stored[name].dump() : "unknown";
    throw FileError(path + ": is of another run, whose " + name + " is " + found + ", not " + value.dump());
  }
  throw FileError(path + ": is of another run, with more options");
}

}  // namespace

void Trajectory::keep(std::uint32_t step, std::span<const BodyState> states) {
  if (every == 0 || step % every != 0) return;
  frame.push_back(step);
  for (const BodyState& state : states) {
    Stored<Vector3>::append(position, state.position);
    Stored<Quaternion>::append(orientation, state.orientation);
    Stored<Vector3>::append(velocity, state.velocity);
    Stored<Vector3>::append(angular_velocity, state.angular_velocity);
  }
}

void write_run(const std::string& path, const RunDescription& run, const RunResults& results) {
  Hdf5Output file(path);
  write_options(file, run.options);
  file.attribute("steps", std::uint64_t{results.records.size()});
  file.attribute("triangles", run.triangles);
  write_bodies(file, run);
  write_rows(file, kFrames, results.records);
  write_trajectory(file, results.trajectory, run.bodies.size());
  write_state(file, results.state);
  file.write();
}

RunResults read_run(const std::string& path, const RunDescription& expected) {
  const Hdf5Input file(path);
  check_options(file, path, expected.options);
  RunResults results;
  if (!read_rows(file, kFrames, results.records))
    throw FileError(path + ": /frames: datasets of different lengths");
  if (file.has("/trajectory")) results.trajectory = read_trajectory(file, path, expected.bodies.size());
  results.state = read_state(file, path, expected.bodies.size());
  if (results.records.size() != results.state.step) {
    throw FileError(path + ": /frames: not of " + std::to_string(results.state.step) + " steps");
  }
  return results;
}

StoredFrame read_frame(const std::string& path, std::uint32_t frame) {
  const Hdf5Input file(path);
  if (!file.has("/trajectory")) throw FileError(path + ": keeps no trajectory; see simulate --trajectory");
  const auto shape = file.read_u32("/bodies/asset");
  const auto centre = file.read_f64("/bodies/centre_of_mass", {3});
  if (centre.size() != 3 * shape.size()) {
    throw FileError(path + ": /bodies/centre_of_mass: " + std::to_string(centre.size() / 3) + " rows for " +
                    std::to_string(shape.size()) + " bodies");
  }
  const Trajectory trajectory = read_trajectory(file, path, shape.size());
  const auto& kept = trajectory.frame;
  const auto found = std::find(kept.begin(), kept.end(), frame);
  if (found == kept.end()) {
    const std::string every = kept.size() < 2 ? "" : ", every " + std::to_string(kept[1] - kept[0]);
    throw FileError(path + ": keeps no frame " + std::to_string(frame) + ", but " +
                    (kept.empty()
                         ? "none"
                         : std::to_string(kept.front()) + " to " + std::to_string(kept.back()) + every));
  }
  StoredFrame stored;
  stored.assets = file.read_strings("/assets");
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] < stored.assets.size()) continue;
    throw FileError(path + ": /bodies/asset: body " + std::to_string(i) + " is of asset " +
                    std::to_string(shape[i]) + " of " + std::to_string(stored.assets.size()));
  }
  if (file.has("/bodies/level")) {
    stored.level = file.read_u32("/bodies/level");
    if (stored.level.size() != shape.size()) throw FileError(path + ": /bodies/level: not of all bodies");
  }
  for (const std::uint32_t motion : file.read_u32("/bodies/motion"))
    stored.motion.push_back(static_cast<Motion>(motion & 3));
  stored.moving.density = file.read_f64("/bodies/density");
  if (stored.motion.size() != shape.size() || stored.moving.density.size() != shape.size())
    throw FileError(path + ": /bodies/motion, /bodies/density: not of all bodies");
  // A fixed body's density is not looked at, but must be one.
  for (double& density : stored.moving.density) density = density > 0 ? density : 1000;
  const auto of_frame = [&](const std::vector<double>& all) {
    const auto first = all.begin() + (found - kept.begin()) * static_cast<std::ptrdiff_t>(3 * shape.size());
    return std::vector<double>(first, first + static_cast<std::ptrdiff_t>(3 * shape.size()));
  };
  stored.moving.velocity = of_frame(trajectory.velocity);
  stored.moving.angular_velocity = of_frame(trajectory.angular_velocity);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const std::size_t at = static_cast<std::size_t>(found - kept.begin()) * shape.size() + i;
    BodyProperties body;
    body.shape = shape[i];
    body.centre = Stored<Vector3>::at(centre, i);
    BodyState state;
    state.position = Stored<Vector3>::at(trajectory.position, at);
    state.orientation = Stored<Quaternion>::at(trajectory.orientation, at);
    stored.poses.push_back(pose_of(body, state));
  }
  return stored;
}

}  // namespace tandem::simulation
