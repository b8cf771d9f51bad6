#include "run_file.h"

#include <algorithm>
#include <variant>

#include "bvhbench/scenes/hdf5_file.h"

namespace tandem::simulation {
namespace {

using bench::FileError;
using bench::Hdf5Input;
using bench::Hdf5Output;
using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Column {
  const char* name;
  std::variant<double StepRecord::*, std::uint64_t StepRecord::*, Vector3d StepRecord::*> member;
};

// Every dataset of /frames, one row for each step.
const Column kColumns[] = {
    {"time", &StepRecord::time},
    {"seconds/update", &StepRecord::update_seconds},
    {"seconds/broad_phase", &StepRecord::broad_phase_seconds},
    {"seconds/traversal", &StepRecord::traversal_seconds},
    {"seconds/triangle_tests", &StepRecord::triangle_test_seconds},
    {"seconds/transfer", &StepRecord::transfer_seconds},
    {"seconds/contacts", &StepRecord::contact_seconds},
    {"seconds/solver", &StepRecord::solver_seconds},
    {"seconds/step", &StepRecord::step_seconds},
    {"object_pairs", &StepRecord::object_pairs},
    {"block_pairs", &StepRecord::block_pairs},
    {"candidates", &StepRecord::candidates},
    {"triangle_pairs", &StepRecord::triangle_pairs},
    {"segments", &StepRecord::segments},
    {"patches", &StepRecord::patches},
    {"open_curves", &StepRecord::open_curves},
    {"contacts", &StepRecord::contacts},
    {"islands", &StepRecord::islands},
    {"newton_islands", &StepRecord::newton_islands},
    {"sleeping", &StepRecord::sleeping},
    {"reentered", &StepRecord::reentered},
    {"contact_ratio", &StepRecord::contact_ratio},
    {"contact_area", &StepRecord::contact_area},
    {"penetration_max", &StepRecord::penetration_max},
    {"penetration_mean", &StepRecord::penetration_mean},
    {"residual_max", &StepRecord::residual_max},
    {"residual_rms", &StepRecord::residual_rms},
    {"kinetic_energy", &StepRecord::kinetic_energy},
    {"potential_energy", &StepRecord::potential_energy},
    {"linear_momentum", &StepRecord::linear_momentum},
    {"angular_momentum", &StepRecord::angular_momentum},
    {"speed_max", &StepRecord::speed_max},
    {"speed_mean", &StepRecord::speed_mean},
    {"spin_max", &StepRecord::spin_max},
};

std::string name_of(const Column& column) {
  return std::string("/frames/") + column.name;
}

void append(std::vector<double>& numbers, const Vector3d& vector) {
  numbers.insert(numbers.end(), vector.data(), vector.data() + 3);
}

void append(std::vector<double>& numbers, const Quaterniond& turn) {
  numbers.insert(numbers.end(), {turn.w(), turn.x(), turn.y(), turn.z()});
}

Vector3d vector_at(const std::vector<double>& numbers, std::size_t i) {
  return Vector3d(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
}

Quaterniond turn_at(const std::vector<double>& numbers, std::size_t i) {
  return Quaterniond(numbers[4 * i], numbers[4 * i + 1], numbers[4 * i + 2], numbers[4 * i + 3]);
}

void write_records(Hdf5Output& file, const std::vector<StepRecord>& records) {
  for (const Column& column : kColumns) {
    if (const auto* number = std::get_if<double StepRecord::*>(&column.member)) {
      std::vector<double> values;
      for (const StepRecord& record : records) values.push_back(record.**number);
      file.add(name_of(column), {records.size()}, values);
    } else if (const auto* count = std::get_if<std::uint64_t StepRecord::*>(&column.member)) {
      std::vector<std::uint64_t> values;
      for (const StepRecord& record : records) values.push_back(record.**count);
      file.add(name_of(column), {records.size()}, values);
    } else {
      std::vector<double> values;
      for (const StepRecord& record : records) {
        append(values, record.*std::get<Vector3d StepRecord::*>(column.member));
      }
      file.add(name_of(column), {records.size(), 3}, values);
    }
  }
}

// One of the columns into all records, which are made with the first.
template <typename Values, typename Value>
void fill(std::vector<StepRecord>& records, std::size_t width, const Values& values, const Value& value_at) {
  if (records.empty()) records.resize(values.size() / width);
  for (std::size_t i = 0; i < std::min(records.size(), values.size() / width); ++i) value_at(records[i], i);
}

std::vector<StepRecord> read_records(const Hdf5Input& file) {
  std::vector<StepRecord> records;
  for (const Column& column : kColumns) {
    if (const auto* number = std::get_if<double StepRecord::*>(&column.member)) {
      const auto values = file.read_f64(name_of(column));
      fill(records, 1, values, [&](StepRecord& record, std::size_t i) { record.** number = values[i]; });
    } else if (const auto* count = std::get_if<std::uint64_t StepRecord::*>(&column.member)) {
      const auto values = file.read_u64(name_of(column));
      fill(records, 1, values, [&](StepRecord& record, std::size_t i) { record.** count = values[i]; });
    } else {
      const auto member = std::get<Vector3d StepRecord::*>(column.member);
      const auto values = file.read_f64(name_of(column), {3});
      fill(records, 3, values,
           [&](StepRecord& record, std::size_t i) { record.*member = vector_at(values, i); });
    }
  }
  return records;
}

void write_bodies(Hdf5Output& file, const RunDescription& run) {
  std::vector<std::uint32_t> asset, level, motion;
  std::vector<double> mass, center, inertia;
  for (const BodyProperties& body : run.bodies) {
    asset.push_back(run.shapes[body.shape].asset);
    level.push_back(run.shapes[body.shape].level);
    motion.push_back(static_cast<std::uint32_t>(body.motion));
    mass.push_back(body.motion == Motion::moving ? body.mass : 0);
    append(center, body.center);
    inertia.insert(inertia.end(), body.inertia.data(), body.inertia.data() + 9);  // symmetric
  }
  const std::size_t count = run.bodies.size();
  file.add("/assets", run.assets);
  file.add("/bodies/asset", {count}, asset);
  if (std::count(level.begin(), level.end(), 0) != static_cast<std::ptrdiff_t>(count))
    file.add("/bodies/level", {count}, level);
  file.add("/bodies/motion", {count}, motion);
  file.add("/bodies/mass", {count}, mass);
  file.add("/bodies/center_of_mass", {count, 3}, center);
  file.add("/bodies/inertia", {count, 3, 3}, inertia);
}

void write_trajectory(Hdf5Output& file, const Trajectory& trajectory, std::size_t bodies) {
  if (trajectory.every == 0) return;
  const std::size_t kept = trajectory.frame.size();
  file.add("/trajectory/frame", {kept}, trajectory.frame);
  file.add("/trajectory/position", {kept, bodies, 3}, trajectory.position);
  file.add("/trajectory/orientation", {kept, bodies, 4}, trajectory.orientation);
}

Trajectory read_trajectory(const Hdf5Input& file, const std::string& path, std::size_t bodies) {
  Trajectory trajectory;
  trajectory.frame = file.read_u32("/trajectory/frame");
  trajectory.position = file.read_f64("/trajectory/position", {bodies, 3});
  trajectory.orientation = file.read_f64("/trajectory/orientation", {bodies, 4});
  const std::size_t states = trajectory.frame.size() * bodies;
  if (trajectory.position.size() != 3 * states || trajectory.orientation.size() != 4 * states) {
    throw FileError(path + ": /trajectory: not of " + std::to_string(trajectory.frame.size()) + " frames");
  }
  return trajectory;
}

void write_contacts(Hdf5Output& file, std::span<const CachedContact> contacts) {
  std::vector<double> in_a, in_b, normal_in_a, depth, translation, rotation, normal, tangential, turning;
  std::vector<std::uint32_t> pair, quiet;
  std::vector<std::uint64_t> feature;
  for (const CachedContact& contact : contacts) {
    pair.insert(pair.end(), {contact.body_a, contact.body_b});
    feature.push_back(contact.feature);
    append(in_a, contact.in_a), append(in_b, contact.in_b), append(normal_in_a, contact.normal_in_a);
    depth.push_back(contact.depth);
    append(translation, contact.found_at.translation), append(rotation, contact.found_at.rotation);
    quiet.push_back(contact.quiet_steps);
    normal.push_back(contact.impulse.normal), append(tangential, contact.impulse.tangential);
    append(turning, contact.impulse.turning);
  }
  const std::size_t count = contacts.size();
  file.add("/state/contacts/pair", {count, 2}, pair);
  file.add("/state/contacts/feature", {count}, feature);
  file.add("/state/contacts/in_a", {count, 3}, in_a);
  file.add("/state/contacts/in_b", {count, 3}, in_b);
  file.add("/state/contacts/normal_in_a", {count, 3}, normal_in_a);
  file.add("/state/contacts/depth", {count}, depth);
  file.add("/state/contacts/found_at_translation", {count, 3}, translation);
  file.add("/state/contacts/found_at_rotation", {count, 4}, rotation);
  file.add("/state/contacts/quiet_steps", {count}, quiet);
  file.add("/state/contacts/normal_impulse", {count}, normal);
  file.add("/state/contacts/tangential_impulse", {count, 3}, tangential);
  file.add("/state/contacts/turning_impulse", {count, 3}, turning);
}

void write_state(Hdf5Output& file, const SimulatorState& state) {
  std::vector<double> position, orientation, velocity, spin;
  for (const BodyState& body : state.states) {
    append(position, body.position), append(orientation, body.orientation);
    append(velocity, body.velocity), append(spin, body.angular_velocity);
  }
  const std::size_t bodies = state.states.size();
  const std::vector<std::uint64_t> step = {state.step};
  file.add("/state/step", {1}, step);
  file.add("/state/position", {bodies, 3}, position);
  file.add("/state/orientation", {bodies, 4}, orientation);
  file.add("/state/velocity", {bodies, 3}, velocity);
  file.add("/state/angular_velocity", {bodies, 3}, spin);
  file.add("/state/quiet_seconds", {bodies}, state.quiet);
  file.add("/state/sleeping_group", {bodies}, state.groups);
  write_contacts(file, state.contacts);
}

std::vector<CachedContact> read_contacts(const Hdf5Input& file, const std::string& path) {
  const auto pair = file.read_u32("/state/contacts/pair", {2});
  const auto feature = file.read_u64("/state/contacts/feature");
  const auto in_a = file.read_f64("/state/contacts/in_a", {3});
  const auto in_b = file.read_f64("/state/contacts/in_b", {3});
  const auto normal_in_a = file.read_f64("/state/contacts/normal_in_a", {3});
  const auto depth = file.read_f64("/state/contacts/depth");
  const auto translation = file.read_f64("/state/contacts/found_at_translation", {3});
  const auto rotation = file.read_f64("/state/contacts/found_at_rotation", {4});
  const auto quiet = file.read_u32("/state/contacts/quiet_steps");
  const auto normal = file.read_f64("/state/contacts/normal_impulse");
  const auto tangential = file.read_f64("/state/contacts/tangential_impulse", {3});
  const auto turning = file.read_f64("/state/contacts/turning_impulse", {3});
  const std::size_t count = feature.size();
  for (const std::size_t rows : {pair.size() / 2, in_a.size() / 3, in_b.size() / 3, normal_in_a.size() / 3,
                                 depth.size(), translation.size() / 3, rotation.size() / 4, quiet.size(),
                                 normal.size(), tangential.size() / 3, turning.size() / 3}) {
    if (rows != count) throw FileError(path + ": /state/contacts: datasets of different lengths");
  }
  std::vector<CachedContact> contacts;
  for (std::size_t i = 0; i < count; ++i) {
    contacts.push_back({pair[2 * i],
                        pair[2 * i + 1],
                        feature[i],
                        vector_at(in_a, i),
                        vector_at(in_b, i),
                        vector_at(normal_in_a, i),
                        depth[i],
                        {vector_at(translation, i), turn_at(rotation, i)},
                        quiet[i],
                        {normal[i], vector_at(tangential, i), vector_at(turning, i)}});
  }
  return contacts;
}

SimulatorState read_state(const Hdf5Input& file, const std::string& path, std::size_t bodies) {
  const auto position = file.read_f64("/state/position", {3});
  const auto orientation = file.read_f64("/state/orientation", {4});
  const auto velocity = file.read_f64("/state/velocity", {3});
  const auto spin = file.read_f64("/state/angular_velocity", {3});
  const auto step = file.read_u64("/state/step");
  SimulatorState state;
  state.quiet = file.read_f64("/state/quiet_seconds");
  state.groups = file.read_u32("/state/sleeping_group");
  state.contacts = read_contacts(file, path);
  const bool fits = step.size() == 1 && position.size() == 3 * bodies && orientation.size() == 4 * bodies &&
                    velocity.size() == 3 * bodies && spin.size() == 3 * bodies &&
                    state.quiet.size() == bodies && state.groups.size() == bodies;
  if (!fits) throw FileError(path + ": /state: not of " + std::to_string(bodies) + " bodies");
  const auto by_pair = [](const CachedContact& one, const CachedContact& other) {
    return std::pair(one.body_a, one.body_b) < std::pair(other.body_a, other.body_b);
  };
  for (const CachedContact& contact : state.contacts) {
    if (contact.body_a >= contact.body_b || contact.body_b >= bodies) {
      throw FileError(path + ": /state/contacts/pair: not two bodies of the run, the lower first");
    }
  }
  if (!std::is_sorted(state.contacts.begin(), state.contacts.end(), by_pair))
    throw FileError(path + ": /state/contacts/pair: not ascending");
  state.step = step[0];
  for (std::size_t i = 0; i < bodies; ++i) {
    state.states.push_back(
        {vector_at(position, i), turn_at(orientation, i), vector_at(velocity, i), vector_at(spin, i)});
  }
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
  for (const BodyState& state : states)
    append(position, state.position), append(orientation, state.orientation);
}

void write_run(const std::string& path, const RunDescription& run, const RunResults& results) {
  Hdf5Output file(path);
  write_options(file, run.options);
  file.attribute("steps", std::uint64_t{results.records.size()});
  file.attribute("triangles", run.triangles);
  write_bodies(file, run);
  write_records(file, results.records);
  write_trajectory(file, results.trajectory, run.bodies.size());
  write_state(file, results.state);
  file.write();
}

RunResults read_run(const std::string& path, const RunDescription& expected) {
  const Hdf5Input file(path);
  check_options(file, path, expected.options);
  RunResults results;
  results.records = read_records(file);
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
  const auto center = file.read_f64("/bodies/center_of_mass", {3});
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
  if (file.has("/bodies/level")) {
    stored.level = file.read_u32("/bodies/level");
    if (stored.level.size() != shape.size()) throw FileError(path + ": /bodies/level: not of all bodies");
  }
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const std::size_t at = static_cast<std::size_t>(found - kept.begin()) * shape.size() + i;
    BodyProperties body;
    body.shape = shape[i];
    body.center = vector_at(center, i);
    BodyState state;
    state.position = vector_at(trajectory.position, at);
    state.orientation = turn_at(trajectory.orientation, at);
    stored.poses.push_back(pose_of(body, state));
  }
  return stored;
}

}  // namespace tandem::simulation
