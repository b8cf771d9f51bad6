#include "compare_results.h"

#include <limits>
#include <set>

#include "bvhbench/scenes/hdf5_file.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

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

std::string count_or_dash(const std::optional<std::uint64_t>& count) {
  return count ? with_commas(*count) : "-";
}

// Returns a peer's number in JSON as a number of HDF5: NaN for null.
double number_of(const Json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

// An array of a scene's group: what the peers say under a key, one after the other. Lists are filled up with
// NaN.
void add_column(Hdf5Output& file, const std::string& path, const std::vector<Json>& peers,
                const std::string& key, std::size_t repeats) {
  if (peers[0][key].is_array()) {
    std::vector<double> table;
    for (std::size_t i = 0; i < peers.size(); ++i) {
      for (const Json& value : peers[i][key]) table.push_back(value.get<double>());
      table.resize((i + 1) * repeats, number_of(Json()));
    }
    file.add(path + key, {peers.size(), repeats}, table);
  } else if (key == "hash" || peers[0][key].is_string()) {
    std::vector<std::string> texts;
    for (const Json& peer : peers) texts.push_back(peer[key].is_null() ? "-" : peer[key].get<std::string>());
    file.add(path + key, texts);
  } else {
    std::vector<double> numbers;
    for (const Json& peer : peers) numbers.push_back(number_of(peer[key]));
    file.add(path + key, {numbers.size()}, numbers);
  }
}

// A group: what JSON says of the scene, with an array for each key of its peers.
void add_scene(Hdf5Output& file, const SceneComparison& scene, std::size_t repeats) {
  const std::string path = "/" + scene.name + "/";
  std::vector<Json> peers;
  std::set<std::string> counted;
  for (const PeerResult& peer : scene.peers) {
    peers.push_back(to_json(peer));
    for (const auto& [name, value] : peer.counters) counted.insert(name);
  }
  for (const auto& [key, value] : peers[0].items()) {
    if (!value.is_object()) add_column(file, path, peers, key, repeats);
  }
  for (const std::string& name : counted) {
    std::vector<double> numbers;
    for (const Json& peer : peers) numbers.push_back(number_of(peer["counters"].value(name, Json())));
    file.add(path + "counters/" + name, {numbers.size()}, numbers);
  }
  const Json all = report_of(scene).json();
  for (const auto& [key, value] : all.items()) {
    if (value.is_number()) file.add(path + key, {1}, std::vector<double>{value.get<double>()});
  }
  file.add(path + "reference", {scene.reference.empty() ? "-" : scene.reference});
}

}  // namespace

Report report_of(const SceneComparison& scene) {
  Report report;
  report.line(format("%s: %s instances, %s triangles, %s object pairs; exact answer by %s",
                     scene.name.c_str(), with_commas(scene.instances).c_str(),
                     with_commas(scene.triangles).c_str(), with_commas(scene.object_pairs).c_str(),
                     scene.reference.empty() ? "nobody" : scene.reference.c_str()));
  report.line(format("  %-13s %9s %9s %9s %9s %10s %9s %9s %10s", "", "build ms", "update ms", "query ms",
                     "median ms", "contacts", "missed", "invented", "memory"));
  Json peers = Json::array();
  for (const PeerResult& peer : scene.peers) {
    report.line(format("  %-13s %9.1f %9.2f %9.2f %9.2f %10s %9s %9s %10s", peer.name.c_str(),
                       1e3 * peer.build_seconds, 1e3 * peer.update_seconds, 1e3 * best_of(peer.query_seconds),
                       1e3 * median_of(peer.query_seconds), count_or_dash(peer.contacts).c_str(),
                       count_or_dash(peer.missed).c_str(), count_or_dash(peer.invented).c_str(),
                       human_bytes(peer.memory_bytes).c_str()));
    peers.push_back(to_json(peer));
  }
  report.add({{"scene", scene.name},
              {"instances", scene.instances},
              {"triangles", scene.triangles},
              {"object_pairs", scene.object_pairs},
              {"reference", or_null(scene.reference)},
              {"peers", std::move(peers)}});
  return report;
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
