#include "compare_results.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>
#include <map>

#include "bvhbench/scenes/hdf5_file.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

Json or_null(const std::optional<std::uint64_t>& value) {
  return value ? Json(*value) : Json();
}

Json to_json(const PeerResult& peer) {
  Json counters = Json::object();
  for (const Counter& counter : peer.counters) counters[counter.first] = counter.second;
  return {{"name", peer.name},
          {"settings", peer.settings},
          {"build_seconds", peer.build_seconds},
          {"update_seconds", peer.update_seconds},
          {"query_seconds_best", best_of(peer.query_seconds)},
          {"query_seconds_median", median_of(peer.query_seconds)},
          {"query_seconds", peer.query_seconds},
          {"contacts", or_null(peer.contacts)},
          {"missed", or_null(peer.missed)},
          {"invented", or_null(peer.invented)},
          {"hash", peer.contacts ? Json(hexadecimal(peer.hash)) : Json()},
          {"memory_bytes", peer.memory_bytes},
          {"work_bytes", peer.work_bytes},
          {"counters", counters}};
}

Json to_json(const SceneComparison& scene) {
  Json peers = Json::array();
  for (const PeerResult& peer : scene.peers) peers.push_back(to_json(peer));
  return {{"scene", scene.name},
          {"instances", scene.instances},
          {"triangles", scene.triangles},
          {"object_pairs", scene.object_pairs},
          {"reference", scene.reference.empty() ? Json() : Json(scene.reference)},
          {"peers", peers}};
}

std::string count_or_dash(const std::optional<std::uint64_t>& count) {
  return count ? with_commas(*count) : "-";
}

std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));
std::string format(const char* pattern, ...) {
  char text[512];
  va_list values;
  va_start(values, pattern);
  std::vsnprintf(text, sizeof text, pattern, values);
  va_end(values);
  return text;
}

double or_nan(const std::optional<std::uint64_t>& value) {
  return value ? static_cast<double>(*value) : std::numeric_limits<double>::quiet_NaN();
}

// The arrays of a scene's group, one value for each peer.
class SceneGroup {
 public:
  SceneGroup(Hdf5Output& file, const SceneComparison& scene)
      : file_(file), scene_(scene), path_("/" + scene.name + "/") {}

  template <class Value>
  void numbers(const char* name, const Value& value) {
    std::vector<double> values;
    for (const PeerResult& peer : scene_.peers) values.push_back(static_cast<double>(value(peer)));
    file_.add(path_ + name, {values.size()}, std::span<const double>(values));
  }

  template <class Value>
  void texts(const char* name, const Value& value) {
    std::vector<std::string> values;
    for (const PeerResult& peer : scene_.peers) values.push_back(value(peer));
    file_.add(path_ + name, values);
  }

  void number(const char* name, std::uint64_t value) {
    const double number = static_cast<double>(value);
    file_.add(path_ + name, {1}, std::span(&number, 1));
  }

  void query_seconds(unsigned repeats) {
    std::vector<double> table;
    for (const PeerResult& peer : scene_.peers) {
      table.insert(table.end(), peer.query_seconds.begin(), peer.query_seconds.end());
      table.resize(table.size() + (repeats - peer.query_seconds.size()),
                   std::numeric_limits<double>::quiet_NaN());
    }
    file_.add(path_ + "query_seconds", {scene_.peers.size(), repeats}, std::span<const double>(table));
  }

  // NaN where a peer has no such counter.
  void counters() {
    std::map<std::string, std::vector<double>> columns;
    for (std::size_t i = 0; i < scene_.peers.size(); ++i) {
      for (const auto& [name, value] : scene_.peers[i].counters) {
        auto& column = columns[name];
        column.resize(scene_.peers.size(), std::numeric_limits<double>::quiet_NaN());
        column[i] = static_cast<double>(value);
      }
    }
    for (const auto& [name, column] : columns) {
      file_.add(path_ + "counters/" + name, {column.size()}, std::span<const double>(column));
    }
  }

 private:
  Hdf5Output& file_;
  const SceneComparison& scene_;
  std::string path_;
};

void add_scene(Hdf5Output& file, const SceneComparison& scene, unsigned repeats) {
  SceneGroup group(file, scene);
  group.texts("name", [](const PeerResult& peer) { return peer.name; });
  group.texts("settings", [](const PeerResult& peer) { return peer.settings; });
  group.texts("hash", [](const PeerResult& peer) { return peer.contacts ? hexadecimal(peer.hash) : "-"; });
  group.numbers("build_seconds", [](const PeerResult& peer) { return peer.build_seconds; });
  group.numbers("update_seconds", [](const PeerResult& peer) { return peer.update_seconds; });
  group.numbers("query_seconds_best", [](const PeerResult& peer) { return best_of(peer.query_seconds); });
  group.numbers("query_seconds_median", [](const PeerResult& peer) { return median_of(peer.query_seconds); });
  group.query_seconds(repeats);
  group.numbers("contacts", [](const PeerResult& peer) { return or_nan(peer.contacts); });
  group.numbers("missed", [](const PeerResult& peer) { return or_nan(peer.missed); });
  group.numbers("invented", [](const PeerResult& peer) { return or_nan(peer.invented); });
  group.numbers("memory_bytes", [](const PeerResult& peer) { return peer.memory_bytes; });
  group.numbers("work_bytes", [](const PeerResult& peer) { return peer.work_bytes; });
  group.counters();
  group.number("instances", scene.instances);
  group.number("triangles", scene.triangles);
  group.number("object_pairs", scene.object_pairs);
  file.add("/" + scene.name + "/reference", {scene.reference.empty() ? "-" : scene.reference});
}

}  // namespace

Json to_json(const CompareResults& results) {
  Json scenes = Json::array();
  for (const SceneComparison& scene : results.scenes) scenes.push_back(to_json(scene));
  return {{"machine", results.machine},
          {"commit", results.commit.empty() ? Json() : Json(results.commit)},
          {"repeats", results.repeats},
          {"scenes", scenes}};
}

std::string to_text(const SceneComparison& scene) {
  std::string text = format("%s: %s instances, %s triangles, %s object pairs; exact answer by %s\n",
                            scene.name.c_str(), with_commas(scene.instances).c_str(),
                            with_commas(scene.triangles).c_str(), with_commas(scene.object_pairs).c_str(),
                            scene.reference.empty() ? "nobody" : scene.reference.c_str());
  text += format("  %-13s %9s %9s %9s %9s %10s %9s %9s %10s\n", "", "build ms", "update ms", "query ms",
                 "median ms", "contacts", "missed", "invented", "memory");
  for (const PeerResult& peer : scene.peers) {
    text += format("  %-13s %9.1f %9.2f %9.2f %9.2f %10s %9s %9s %10s\n", peer.name.c_str(),
                   1e3 * peer.build_seconds, 1e3 * peer.update_seconds, 1e3 * best_of(peer.query_seconds),
                   1e3 * median_of(peer.query_seconds), count_or_dash(peer.contacts).c_str(),
                   count_or_dash(peer.missed).c_str(), count_or_dash(peer.invented).c_str(),
                   human_bytes(peer.memory_bytes).c_str());
  }
  return text;
}

void write_results(const std::string& path, const CompareResults& results) {
  Hdf5Output file(path);
  file.attribute("machine", results.machine);
  file.attribute("commit", results.commit);
  file.attribute("repeats", std::uint64_t{results.repeats});
  for (const SceneComparison& scene : results.scenes) add_scene(file, scene, results.repeats);
  file.write();
}

}  // namespace tandem::bench
