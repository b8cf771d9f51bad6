// Holds every door of C++ and C to the table scenes.json. tests/python/contract_test.py and command_test.py
// hold the Python package and bvhbench to the same table.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>

#include "contract/doors.h"
#include "tandem/formats/hash.h"

namespace tandem::test {
namespace {

/// A folder that is elsewhere where the program runs than where it was built.
std::string folder(const char* variable, const char* built) {
  const char* const given = std::getenv(variable);
  return given != nullptr ? given : built;
}

const Json& table() {
  static const Json read = Json::parse(
      std::ifstream(folder("TANDEM_SOURCE_DIR", TANDEM_SOURCE_DIR) + "/tests/contract/scenes.json"));
  return read;
}

/// SplitMix64, as scene_table.py has it, so that every door scatters the same bodies.
class Scatter {
 public:
  explicit Scatter(std::uint64_t seed) : state_(seed) {}

  double uniform() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return static_cast<double>((z ^ z >> 31) >> 11) * 0x1p-53;
  }

  Instance body(std::uint32_t assets, double size, double at) {
    Instance body = {static_cast<std::uint32_t>(uniform() * assets), {}};
    double q[4], square = 0;
    for (double& x : q) x = uniform() - 0.5, square += x * x;
    for (double& x : q) x /= std::sqrt(square);
    const auto [w, x, y, z] = q;
    body.pose = {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                  {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                  {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}},
                 {}};
    for (double& to : body.pose.translation) to = uniform() * size + at;
    return body;
  }

 private:
  std::uint64_t state_;
};

Instance body_of(const Json& entry) {
  Instance body = {0, kIdentityPose};
  const Json& at = entry.is_array() ? entry : entry["at"];
  for (int k = 0; k < 3; ++k) body.pose.translation[k] = number(at[k]);
  if (entry.is_array()) return body;
  body.asset = entry.value("asset", 0u);
  for (int k = 0; k < 9 && entry.contains("rotation"); ++k)
    body.pose.rotation[k / 3][k % 3] = number(entry["rotation"][k / 3][k % 3]);
  return body;
}

std::vector<Instance> instances_of(const Json& list) {
  std::vector<Instance> bodies;
  if (list.is_array()) {
    for (const Json& entry : list) bodies.push_back(body_of(entry));
  } else if (list.contains("row")) {
    for (int i = 0; i < list["row"][0]; ++i) bodies.push_back(body_of({number(list["row"][1]) * i, 0, 0}));
  } else if (list.contains("grid")) {
    const std::array<int, 3> n = list["grid"];
    for (int i = 0; i < n[0] * n[1] * n[2]; ++i)
      bodies.push_back(body_of({i % n[0], i / n[0] % n[1], i / n[0] / n[1]}));
  } else {
    const Json& scatter = list["scatter"];
    Scatter random(scatter["seed"]);
    for (int i = 0; i < scatter["count"]; ++i)
      bodies.push_back(random.body(scatter["assets"], number(scatter["size"]), number(scatter, "at", 0)));
  }
  return bodies;
}

/// An entry's array, or the one number of a single body's filter.
template <typename Number>
std::vector<Number> column(const Json& filter, const char* name) {
  if (!filter.contains(name)) return {};
  if (filter[name].is_array()) return filter[name];
  return {filter[name].get<Number>()};
}

Bodies bodies_of(const Json& list, const Json& filter) {
  Bodies bodies = {instances_of(list),
                   column<std::uint8_t>(filter, "motion"),
                   column<std::uint32_t>(filter, "group"),
                   column<std::uint32_t>(filter, "mask"),
                   column<std::uint32_t>(filter, "world"),
                   {}};
  if (filter.contains("excluded")) bodies.excluded = pairs_of(filter["excluded"]);
  return bodies;
}

/// XXH64 of pairs and contacts by the rule of docs/scenes.md, as bvhbench prints it.
std::string hash_of(const Found& found) {
  std::vector<std::array<std::uint32_t, 3>> contacts;
  for (const Json& row : found.rows) {
    std::array<std::uint32_t, 3> contact = {row["pair"], row["face_a"], row["face_b"]};
    const ObjectPair& pair = found.pairs[contact[0]];
    if (pair.a == pair.b && contact[2] < contact[1]) std::swap(contact[1], contact[2]);
    contacts.push_back(contact);
  }
  std::ranges::sort(contacts);
  std::vector<std::uint32_t> words;
  for (const ObjectPair& pair : found.pairs) words.insert(words.end(), {pair.a, pair.b});
  for (int k = 0; k < 3; ++k)
    for (const auto& contact : contacts) words.push_back(contact[k]);
  char text[17];
  std::snprintf(text, sizeof text, "%016llx",
                static_cast<unsigned long long>(xxh64(words.data(), words.size() * sizeof words[0])));
  return text;
}

/// Whether a value is in a range [least, most], or each part of it in one of as many.
bool is_within(const Json& value, const Json& range) {
  if (!value.is_array()) return number(range[0]) <= number(value) && number(value) <= number(range[1]);
  bool within = value.size() == range.size();
  for (std::size_t i = 0; within && i < value.size(); ++i) within = is_within(value[i], range[i]);
  return within;
}

/// Whether a value is what the table says, where infinity is a string.
bool is_equal(const Json& value, const Json& expected) {
  return expected.is_string() ? number(value) == number(expected) : value == expected;
}

/// Compares rows with "rows", "least_rows", "columns" and "ranges" of an expectation.
void expect_rows(const std::vector<Json>& rows, const Json& expected) {
  EXPECT_EQ(rows.size(), expected.value("rows", rows.size()));
  EXPECT_GE(rows.size(), expected.value("least_rows", std::size_t{0}));
  for (const char* kind : {"columns", "ranges"}) {
    const Json fields = expected.value(kind, Json::object());
    for (const auto& [field, values] : fields.items()) {
      ASSERT_EQ(rows.size(), values.size()) << field;
      for (std::size_t i = 0; i < rows.size(); ++i)
        EXPECT_PRED2(kind[0] == 'c' ? is_equal : is_within, rows[i].at(field), values[i])
            << field << " of row " << i;
    }
  }
}

void expect_outcome(const Outcome& outcome, const Json& expected) {
  EXPECT_EQ(outcome.status, expected.value("status", "Ok"));
  EXPECT_EQ(outcome.where, expected.value("where", outcome.where));
}

void expect_found(Found found, const Json& expected) {
  expect_outcome(found, expected);
  // Within a pair, contacts may come in any order on a GPU.
  if (!found.rows.empty() && found.rows[0].contains("face_a") && !found.rows[0].contains("gap"))
    std::ranges::stable_sort(found.rows, {}, [&](const Json& row) {
      return row.contains("pair") ? std::array<std::uint32_t, 3>{row["pair"], row["face_a"], row["face_b"]}
                                  : std::array<std::uint32_t, 3>{};
    });
  if (expected.contains("pairs")) {
    Json pairs = Json::array();
    for (const ObjectPair& pair : found.pairs) pairs.push_back({pair.a, pair.b});
    EXPECT_EQ(pairs, expected["pairs"]);
  }
  expect_rows(found.rows, expected);
  if (expected.contains("points")) expect_rows(found.points, expected["points"]);
  const Json counters = expected.value("counters", Json::object());
  for (const auto& [counter, count] : counters.items())
    EXPECT_EQ(found.counters.at(counter), count) << counter;
  if (expected.contains("hash")) {
    EXPECT_EQ(hash_of(found), expected["hash"].get<std::string>());
  }
}

void take_step(Door& door, const Json& step) {
  const Json expected = step.value("expect", Json::object()), filter = step.value("filter", Json::object());
  if (step.contains("place")) {
    expect_outcome(door.place(bodies_of(step["place"], filter)), expected);
  } else if (step.contains("add")) {
    std::uint32_t body = kNoIndex;
    expect_outcome(door.add(bodies_of(Json::array({step["add"]}), filter), body), expected);
    EXPECT_EQ(body, expected.value("body", kNoIndex));
  } else if (step.contains("move")) {
    expect_outcome(door.move(step["move"], bodies_of(step["to"], {})), expected);
  } else if (step.contains("set_motion")) {
    expect_outcome(door.set_motion(step["set_motion"][0], step["set_motion"][1]), expected);
  } else if (step.contains("remove")) {
    expect_outcome(door.remove(step["remove"]), expected);
  } else if (step.contains("threads")) {
    expect_outcome(door.set_threads(step["threads"]), expected);
  } else if (step.contains("standing")) {
    Json assets = Json::array();
    for (const std::uint32_t asset : door.assets_of_bodies())
      assets.push_back(asset == kNoIndex ? Json() : Json(asset));
    EXPECT_EQ(assets, step["standing"]);
  } else {
    expect_found(door.ask(step["ask"], step), expected);
  }
}

using Parameter = std::tuple<NamedDoor, Json>;

class Contract : public testing::TestWithParam<Parameter> {
 protected:
  void SetUp() override {
    if (!doors_are_usable()) GTEST_SKIP() << "no GPU here";
  }
};

TEST_P(Contract, Holds) {
  const auto& [named, scene] = GetParam();
  const std::unique_ptr<Door> door = named.open();
  std::vector<std::string> files;
  const std::string meshes = folder("TANDEM_CONTRACT_MESHES", TANDEM_CONTRACT_MESHES);
  for (const std::string mesh : scene["assets"]) files.push_back(meshes + "/" + mesh + ".bvh");
  expect_outcome(door->set_assets(files), Json::object());
  for (const Json& step : scene["steps"]) {
    SCOPED_TRACE(step.dump());
    if (step.contains("except") && step["except"].contains(named.interface)) {
      std::printf("left out: %s: %s\n", step.dump().c_str(), step["except"][named.interface].dump().c_str());
      continue;
    }
    take_step(*door, step);
  }
}

INSTANTIATE_TEST_SUITE_P(Doors, Contract,
                         testing::Combine(testing::ValuesIn(doors()), testing::ValuesIn(table()["scenes"])),
                         [](const auto& test) {
                           return std::string(std::get<0>(test.param).name) + "_" +
                                  std::get<1>(test.param)["name"].template get<std::string>();
                         });

}  // namespace
}  // namespace tandem::test
