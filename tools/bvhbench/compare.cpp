#include "compare.h"

#include <malloc.h>

#include <algorithm>
#include <filesystem>

#include "bvhbench/scenes/contacts_file.h"
#include "bvhbench/scenes/make_scene.h"
#include "bvhbench/scenes/scene_file.h"
#include "tandem/formats/hash.h"

namespace tandem::bench {
namespace {

using Contacts = std::optional<std::vector<TriangleContact>>;

// Bytes that malloc has handed out, large mappings included.
std::uint64_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

std::uint64_t growth(std::uint64_t before, std::uint64_t after) {
  return after > before ? after - before : 0;
}

struct Frame {
  const LoadedScene& scene;
  std::vector<AssetView> assets;
  std::vector<ObjectPair> pairs;

  std::span<const Instance> instances() const { return scene.description.instances; }
};

void check_poses(const std::string& path, const LoadedScene& scene) {
  const auto& instances = scene.description.instances;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (!is_rigid(instances[i].pose))
      throw FileError(path + ": instance " + std::to_string(i) + ": the pose is not rigid");
  }
}

std::vector<ObjectPair> given_pairs(const std::string& path, const LoadedScene& scene) {
  const std::vector<ObjectPair> pairs = normalised(*scene.description.pairs);
  for (const ObjectPair& pair : pairs) {
    if (pair.a == pair.b)
      throw FileError(path + ": /pairs: an instance with itself, which only Tandem can do");
  }
  return pairs;
}

std::vector<ObjectPair> found_pairs(const std::string& path, const LoadedScene& scene) {
  ExcludedPairTable excluded;
  try {
    return find_box_pairs(scene.views(), scene.description.instances,
                          scene.description.filter.view(excluded));
  } catch (const std::runtime_error& error) {
    throw FileError(path + ": " + error.what());
  }
}

void prepare(Engine& peer, const Frame& frame, PeerResult& result) {
  result.name = peer.label();
  result.settings = peer.settings();
  const std::uint64_t before = heap_bytes();
  result.build_seconds = seconds_of([&] {
    peer.set_shapes(frame.assets);
    peer.update(frame.instances());
  });
  const auto update = [&] { return seconds_of([&] { peer.update(frame.instances()); }); };
  result.update_seconds = update();
  constexpr double kLong = 1;  // seconds: repeating it would tell little more
  for (int i = 1; i < 3 && result.update_seconds < kLong; ++i) {
    result.update_seconds = std::min(result.update_seconds, update());
  }
  result.memory_bytes = growth(before, heap_bytes()) + peer.bytes_beside_heap();
}

// The first query, which makes room for what it finds, is not timed; nor is anything else but a query.
Contacts answer_of(Engine& peer, const Frame& frame, PeerResult& result) {
  const std::uint64_t before = heap_bytes() + peer.bytes_beside_heap();
  const double seconds = seconds_of([&] { peer.query(frame.pairs); });
  result.work_bytes = growth(before, heap_bytes() + peer.bytes_beside_heap());
  if (peer.is_reference()) result.query_seconds = {seconds};
  result.counters = peer.named_counters();
  std::vector<TriangleContact> contacts;
  if (!peer.contacts(contacts)) return {};
  std::sort(contacts.begin(), contacts.end());
  result.contacts = contacts.size();
  result.hash = xxh64(contacts.data(), contacts.size() * sizeof(TriangleContact));
  return contacts;
}

// Counts the contacts that are in a and not in b.
std::uint64_t count_missing(const std::vector<TriangleContact>& a, const std::vector<TriangleContact>& b) {
  std::vector<TriangleContact> difference;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(difference));
  return difference.size();
}

std::size_t find_reference(Peers peers) {
  const auto find = [&](const auto& matches) {
    return static_cast<std::size_t>(std::find_if(peers.begin(), peers.end(), matches) - peers.begin());
  };
  const std::size_t independent = find([](const auto& peer) { return peer->is_reference(); });
  if (independent < peers.size()) return independent;
  return find([](const auto& peer) { return peer->label() == "Tandem exact"; });
}

void judge(SceneComparison& comparison, const std::vector<Contacts>& answers, std::size_t reference) {
  if (reference >= answers.size()) return;
  comparison.reference = comparison.peers[reference].name;
  const std::vector<TriangleContact>& truth = *answers[reference];
  for (std::size_t i = 0; i < answers.size(); ++i) {
    if (!answers[i]) continue;
    comparison.peers[i].missed = count_missing(truth, *answers[i]);
    comparison.peers[i].invented = count_missing(*answers[i], truth);
  }
}

}  // namespace

SceneComparison compare(const std::string& path, Peers peers, unsigned repeats) {
  const LoadedScene scene = read_scene(path);
  check_poses(path, scene);
  const Frame frame = {scene, scene.views(),
                       scene.description.pairs ? given_pairs(path, scene) : found_pairs(path, scene)};

  SceneComparison comparison;
  comparison.name = std::filesystem::path(path).stem().string();
  comparison.instances = frame.instances().size();
  for (const Instance& i : frame.instances())
    comparison.triangles += frame.assets[i.asset].level().triangle_count;
  comparison.object_pairs = frame.pairs.size();
  comparison.peers.resize(peers.size());
  std::vector<Contacts> answers;
  for (std::size_t i = 0; i < peers.size(); ++i) {
    prepare(*peers[i], frame, comparison.peers[i]);
    answers.push_back(answer_of(*peers[i], frame, comparison.peers[i]));
  }
  judge(comparison, answers, find_reference(peers));
  answers.clear();
  race(
      peers, repeats, comparison.peers, [&](Engine& peer) { peer.query(frame.pairs); },
      [](const Engine&, const PeerResult&) {});
  return comparison;
}

}  // namespace tandem::bench
