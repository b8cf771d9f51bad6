#pragma once
#include <tandem/tandem.h>

#include <array>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "tandem/kernels/motion.h"
#include "tandem/kernels/scene.h"

/// The doors through which the table tests/contract/scenes.json is asked.
namespace tandem::test {

using Json = nlohmann::json;

/// Bodies of the table, ready for any door.
struct Bodies {
  std::vector<Instance> instances;
  std::vector<std::uint8_t> motion;  ///< or empty, as the next four
  std::vector<std::uint32_t> group, mask, world;
  std::vector<ObjectPair> excluded;
};

/// The answer of a call: the name of its status, and the row to blame.
struct Outcome {
  std::string status = "Ok";
  std::uint64_t where = 0;
};

/// The answer of a question. Rows, points and counters are objects with the fields' names, which C++ and C
/// spell alike.
struct Found : Outcome {
  std::vector<ObjectPair> pairs;
  std::vector<Json> rows, points;
  Json counters;
};

/// A scene behind one of the interfaces.
class Door {
 public:
  virtual ~Door() = default;
  virtual Outcome set_assets(const std::vector<std::string>& files) = 0;
  virtual Outcome set_threads(std::uint32_t threads) = 0;
  virtual Outcome place(const Bodies& bodies) = 0;
  /// Adds the one body that there is; `number` becomes its number.
  virtual Outcome add(const Bodies& body, std::uint32_t& number) = 0;
  virtual Outcome move(const std::vector<std::uint32_t>& numbers, const Bodies& poses) = 0;
  virtual Outcome set_motion(std::uint32_t body, std::uint32_t motion) = 0;
  virtual Outcome remove(std::uint32_t body) = 0;
  virtual std::vector<std::uint32_t> assets_of_bodies() const = 0;
  /// Asks `question`, such as "contacts", with its options by their names.
  virtual Found ask(const std::string& question, const Json& options) = 0;
};

/// Scene, or what derives from it, and the question objects of C++.
std::unique_ptr<Door> cpp_door(std::shared_ptr<Scene> scene);

/// The C interface, of a scene that `create` makes: tandem_scene_create, or one that answers elsewhere. Its
/// memory is counted, and all must have come back when the door closes.
using SceneMaker = tandem_status(const tandem_allocator*, tandem_scene**);
std::unique_ptr<Door> c_door(SceneMaker* create);

/// A number of the table: "nan", "inf" and "-inf" are strings there.
inline double number(const Json& from) {
  return from.is_string() ? std::stod(from.get<std::string>()) : from.get<double>();
}
inline double number(const Json& options, const char* name, double otherwise) {
  return options.contains(name) ? number(options[name]) : otherwise;
}
inline bool flag(const Json& options, const char* name, bool otherwise = false) {
  return options.value(name, otherwise);
}

/// The object pairs of a list of the table.
inline std::vector<ObjectPair> pairs_of(const Json& list) {
  std::vector<ObjectPair> pairs;
  for (const Json& pair : list) pairs.push_back({pair[0].get<std::uint32_t>(), pair[1].get<std::uint32_t>()});
  return pairs;
}

inline std::vector<std::array<double, 3>> points_of(const Json& options, const char* name = "points") {
  std::vector<std::array<double, 3>> points;
  for (const Json& point : options[name])
    points.push_back({number(point[0]), number(point[1]), number(point[2])});
  return points;
}

/// The number that means a choice of `hits` of the table.
inline std::uint32_t hits_of(const Json& options) {
  const std::string hits = options.value("hits", "first");
  return hits == "first" ? 0 : hits == "any" ? 1 : 2;
}

/// Motions of the table: rows of a velocity and, where they have nine numbers, an angular velocity and a
/// centre; "none": all of `bodies` bodies rest.
inline std::vector<RigidMotion> motions_of(const Json& list, std::size_t bodies) {
  if (list.is_string()) return std::vector<RigidMotion>(bodies, RigidMotion{});
  std::vector<RigidMotion> motions;
  for (const Json& row : list) {
    RigidMotion& motion = motions.emplace_back(RigidMotion{});
    double* const parts[3] = {motion.velocity, motion.angular_velocity, motion.centre};
    for (std::size_t i = 0; i < row.size(); ++i) parts[i / 3][i % 3] = number(row[i]);
  }
  return motions;
}

template <typename Value>
Json plain(const Value& value) {
  if constexpr (std::is_enum_v<Value>) {
    return static_cast<std::underlying_type_t<Value>>(value);
  } else {
    return value;
  }
}

/// A row, or counters, as an object with those of these fields that it has.
template <typename Row>
Json object_of(const Row& row) {
  Json object = Json::object();
// clang-format off
#define TANDEM_FIELD(field) \
  if constexpr (requires { row.field; }) object[#field] = plain(row.field);
  TANDEM_FIELD(a) TANDEM_FIELD(b) TANDEM_FIELD(kept) TANDEM_FIELD(point) TANDEM_FIELD(body) TANDEM_FIELD(pair) TANDEM_FIELD(triangle_a) TANDEM_FIELD(triangle_b) TANDEM_FIELD(face_a)
  TANDEM_FIELD(face_b) TANDEM_FIELD(normal) TANDEM_FIELD(area_vector) TANDEM_FIELD(centre)
  TANDEM_FIELD(depth) TANDEM_FIELD(first_point) TANDEM_FIELD(point_count) TANDEM_FIELD(flags)
  TANDEM_FIELD(position) TANDEM_FIELD(in_a) TANDEM_FIELD(in_b) TANDEM_FIELD(id) TANDEM_FIELD(previous)
  TANDEM_FIELD(manifold) TANDEM_FIELD(inner) TANDEM_FIELD(component) TANDEM_FIELD(lower) TANDEM_FIELD(upper)
  TANDEM_FIELD(point_a) TANDEM_FIELD(point_b) TANDEM_FIELD(t_safe) TANDEM_FIELD(gap) TANDEM_FIELD(status)
  TANDEM_FIELD(verdict) TANDEM_FIELD(level_a) TANDEM_FIELD(level_b) TANDEM_FIELD(object_pairs)
  TANDEM_FIELD(contacts) TANDEM_FIELD(manifolds) TANDEM_FIELD(points) TANDEM_FIELD(open_curves)
  TANDEM_FIELD(ambiguous_touches) TANDEM_FIELD(inside) TANDEM_FIELD(outer_open) TANDEM_FIELD(touching)
  TANDEM_FIELD(at_start) TANDEM_FIELD(found) TANDEM_FIELD(apart) TANDEM_FIELD(within_tolerance)
  TANDEM_FIELD(t) TANDEM_FIELD(ray) TANDEM_FIELD(within) TANDEM_FIELD(winding)
  // clang-format on
#undef TANDEM_FIELD
                                                                      return object;
}

template <typename Rows>
std::vector<Json> objects_of(const Rows& rows) {
  std::vector<Json> objects;
  for (const auto& row : rows) objects.push_back(object_of(row));
  return objects;
}

}  // namespace tandem::test
