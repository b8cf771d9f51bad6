#include "compare_distance.h"

#include <algorithm>
#include <filesystem>

#include "bvhbench/engines/registry.h"
#include "command.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

struct CertifiedPairs {
  std::vector<ObjectPair> pairs;
  std::vector<double> lower, upper;
};

CertifiedPairs certified_pairs(const LoadedScene& scene, const std::vector<AssetView>& views, double reach) {
  const auto engine = make_engine("tandem", DistanceOptions{.reach = reach});
  engine->set_shapes(views);
  engine->update(scene.description.instances);
  const TimedDistances found = engine->time_distances({});
  CertifiedPairs out;
  for (std::size_t i = 0; i < found.pairs.size(); ++i) {
    const ObjectDistance& distance = found.rows[i];
    if (distance.upper == 0 || distance.upper > reach) continue;
    out.pairs.push_back(found.pairs[i]);
    out.lower.push_back(distance.lower);
    out.upper.push_back(distance.upper);
  }
  return out;
}

double worst_error(const CertifiedPairs& pairs, const std::vector<double>& distances) {
  double worst = 0;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const double beyond = std::max(pairs.lower[i] - distances[i], distances[i] - pairs.upper[i]);
    worst = std::max(worst, beyond / pairs.upper[i]);
  }
  return worst;
}

// Returns the number of triangles of both bodies of every pair.
std::uint64_t triangles_of_pairs(const LoadedScene& scene, const std::vector<ObjectPair>& pairs) {
  std::uint64_t sum = 0;
  for (const auto& [a, b] : pairs) {
    for (const std::uint32_t body : {a, b})
      sum += scene.view(scene.description.instances[body].asset).level().triangle_count;
  }
  return sum;
}

}  // namespace

DistanceComparison compare_distances(const std::string& path, double reach, unsigned repeats) {
  const LoadedScene scene = read_scene(path);
  const std::vector<AssetView> views = scene.views();
  const CertifiedPairs pairs = certified_pairs(scene, views, reach);
  DistanceComparison out;
  out.name = std::filesystem::path(path).stem().string();
  out.reach = reach;
  out.instances = scene.description.instances.size();
  out.object_pairs = pairs.pairs.size();
  auto engines = make_peers(DistanceOptions());
  if (triangles_of_pairs(scene, pairs.pairs) > kMostReferenceTriangles)
    std::erase_if(engines, [](const auto& engine) { return engine->is_reference(); });
  out.peers = prepared<DistancePeer>(engines, views, scene.description.instances);
  std::vector<double> distances;
  race(
      engines, repeats, out.peers, [&](Engine& engine) { engine.find_distances(pairs.pairs, distances); },
      [&](const Engine& engine, DistancePeer& peer) {
        peer.worst_error = worst_error(pairs, distances);
        if (engine.is_reference()) peer.outside = engine.outside(pairs.lower, pairs.upper);
      });
  return out;
}

Report report_of(const DistanceComparison& comparison) {
  Report report;
  report.line(format("%s: %s instances, %s pairs apart and within %g", comparison.name.c_str(),
                     with_commas(comparison.instances).c_str(), with_commas(comparison.object_pairs).c_str(),
                     comparison.reach));
  Json peers = Json::array();
  for (const DistancePeer& peer : comparison.peers) {
    const double best = best_of(peer.query_seconds);
    report.line(format("  %-12s %10.3f ms  %8.2f times  error %.1e  built in %.3f s", peer.name.c_str(),
                       1e3 * best, best / best_of(comparison.peers[0].query_seconds), peer.worst_error,
                       peer.build_seconds));
    if (peer.outside) {
      report.line(format("  %-12s %s of Tandem's intervals do not hold its exact distance", "",
                         with_commas(*peer.outside).c_str()));
    }
    peers.push_back({{"name", peer.name},
                     {"settings", peer.settings},
                     {"build_seconds", peer.build_seconds},
                     {"best_seconds", best},
                     {"median_seconds", median_of(peer.query_seconds)},
                     {"worst_error", peer.worst_error},
                     {"outside", or_null(peer.outside)}});
  }
  report.add({{"scene", comparison.name},
              {"reach", comparison.reach},
              {"instances", comparison.instances},
              {"object_pairs", comparison.object_pairs},
              {"peers", std::move(peers)}});
  return report;
}

}  // namespace tandem::bench
