#include "compare_impact.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bvhbench/engines/registry.h"
#include "command.h"
#include "common/number_words.h"
#include "scene_motions.h"

namespace tandem::bench {
namespace {

/// The times that are known of a pair: no contact before `safe`, and one at `contact`, in seconds; infinite
/// where none is in the step, or none was found.
struct KnownImpact {
  ObjectPair pair;
  double safe, contact;
};

// The most that a body may turn, in radians: from half a turn on, the shortest rotation to the end of the
// step is another one.
constexpr double kMostTurn = 3.14;

void check_turns(const std::string& path, const std::vector<RigidMotion>& motions, double duration) {
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const auto& w = motions[i].angular_velocity;
    if (duration * std::hypot(w[0], w[1], w[2]) < kMostTurn) continue;
    throw FileError(path + ": instance " + std::to_string(i) +
                    " turns by half a turn or more in the step, which other libraries do not");
  }
}

/// Looks for contacts of moving pairs at times in a step.
class ContactSearch {
 public:
  ContactSearch(const LoadedScene& scene, const std::vector<AssetView>& views,
                const std::vector<RigidMotion>& motions, double duration)
      : instances_(scene.description.instances), motions_(motions), duration_(duration) {
    engine_->set_shapes(views);
  }

  /// The first of 151 times after `safe` at which one is found: soon after it, then at even times.
  double first_after(const ObjectPair& pair, double safe) {
    constexpr int kSoonest = 30, kEven = 128;  // the rest of the step over 2^30, and its 128ths
    const double rest = duration_ - safe;
    for (int k = kSoonest; k > 7; --k) {
      const double time = safe + std::ldexp(rest, -k);
      if (in_contact(pair, time)) return time;
    }
    for (int k = 1; k <= kEven; ++k) {
      const double time = safe + rest * k / kEven;
      if (in_contact(pair, time)) return time;
    }
    return INFINITY;
  }

 private:
  bool in_contact(const ObjectPair& pair, double time) {
    const auto at = [&](std::uint32_t i) {
      return Instance{instances_[i].asset, pose_at(instances_[i].pose, motions_[i], time)};
    };
    const Instance two[] = {at(pair.a), at(pair.b)};
    const ObjectPair both[] = {{0, 1}};
    engine_->update(two);
    engine_->query(both);
    engine_->contacts(found_);
    return !found_.empty();
  }

  const std::vector<Instance>& instances_;
  const std::vector<RigidMotion>& motions_;
  const double duration_;
  const std::unique_ptr<Engine> engine_ = make_engine("tandem", ContactOptions{.first_contact_only = true});
  std::vector<TriangleContact> found_;
};

std::vector<KnownImpact> known_impacts(const LoadedScene& scene, const std::vector<AssetView>& views,
                                       const std::vector<RigidMotion>& motions, double duration) {
  const auto engine = make_engine("tandem", ImpactOptions());
  engine->set_shapes(views);
  engine->set_motion(motions, duration);
  engine->update(scene.description.instances);
  const TimedImpacts found = engine->time_impacts({});
  ContactSearch search(scene, views, motions, duration);
  std::vector<KnownImpact> known;
  for (std::size_t i = 0; i < found.pairs.size(); ++i) {
    const Impact& impact = found.rows[i];
    const ObjectPair& pair = found.pairs[i];
    if (impact.status == ImpactStatus::none) known.push_back({pair, INFINITY, INFINITY});
    if (impact.status == ImpactStatus::at_start) known.push_back({pair, 0, 0});
    if (impact.status == ImpactStatus::found)
      known.push_back({pair, impact.t_safe, search.first_after(pair, impact.t_safe)});
  }
  return known;
}

void judge(const std::vector<KnownImpact>& known, const std::vector<double>& times, double duration,
           ImpactPeer& peer) {
  std::vector<double> early;
  for (std::size_t i = 0; i < known.size(); ++i) {
    const auto& [pair, safe, contact] = known[i];
    const bool told = times[i] <= duration;
    peer.found += told;
    if (told && std::isinf(safe)) ++peer.invented;
    if (!told && contact <= duration) ++peer.missed;
    if (told && times[i] < safe && safe <= duration) early.push_back((safe - times[i]) / duration);
    if (!told || times[i] <= contact) continue;
    ++peer.late;
    peer.most_late = std::max(peer.most_late, (times[i] - contact) / duration);
  }
  if (early.empty()) return;
  peer.median_early = median_of(early);
  peer.most_early = *std::max_element(early.begin(), early.end());
}

}  // namespace

ImpactComparison compare_impacts(const std::string& path, double duration, unsigned repeats) {
  const LoadedScene scene = read_scene(path);
  const std::vector<AssetView> views = scene.views();
  const std::vector<RigidMotion> motions = motions_of(path, scene);
  check_turns(path, motions, duration);
  const std::vector<KnownImpact> known = known_impacts(scene, views, motions, duration);
  ImpactComparison out;
  out.name = std::filesystem::path(path).stem().string();
  out.duration = duration;
  out.instances = scene.description.instances.size();
  out.object_pairs = known.size();
  std::vector<ObjectPair> pairs;
  for (const auto& [pair, safe, contact] : known) {
    pairs.push_back(pair);
    out.at_start += contact == 0;
    out.stopped += contact != 0 && std::isfinite(safe);
    out.in_contact += contact != 0 && std::isfinite(contact);
  }
  const auto engines = make_peers(ImpactOptions());
  for (const auto& engine : engines) engine->set_motion(motions, duration);
  out.peers = prepared<ImpactPeer>(engines, views, scene.description.instances);
  std::vector<double> times;
  race(
      engines, repeats, out.peers, [&](Engine& engine) { engine.find_impacts(pairs, times); },
      [&](const Engine&, ImpactPeer& peer) { judge(known, times, duration, peer); });
  return out;
}

Report report_of(const ImpactComparison& comparison) {
  Report report;
  report.line(format("%s: %s instances move for %g s, %s pairs: %s touch already, %s stop, of which %s meet",
                     comparison.name.c_str(), with_commas(comparison.instances).c_str(), comparison.duration,
                     with_commas(comparison.object_pairs).c_str(), with_commas(comparison.at_start).c_str(),
                     with_commas(comparison.stopped).c_str(), with_commas(comparison.in_contact).c_str()));
  Json peers = Json::array();
  for (const ImpactPeer& peer : comparison.peers) {
    const double best = best_of(peer.query_seconds);
    report.line(format(
        "  %-14s %10.3f ms %8.2f times %7s found %6s missed %6s late by %.0e %6s invented, early by %.0e, at "
        "most %.0e",
        peer.name.c_str(), 1e3 * best, best / best_of(comparison.peers[0].query_seconds),
        with_commas(peer.found).c_str(), with_commas(peer.missed).c_str(), with_commas(peer.late).c_str(),
        peer.most_late, with_commas(peer.invented).c_str(), peer.median_early, peer.most_early));
    peers.push_back({{"name", peer.name},
                     {"settings", peer.settings},
                     {"build_seconds", peer.build_seconds},
                     {"update_seconds", peer.update_seconds},
                     {"best_seconds", best},
                     {"median_seconds", median_of(peer.query_seconds)},
                     {"found", peer.found},
                     {"missed", peer.missed},
                     {"late", peer.late},
                     {"invented", peer.invented},
                     {"median_early", peer.median_early},
                     {"most_early", peer.most_early},
                     {"most_late", peer.most_late}});
  }
  report.add({{"scene", comparison.name},
              {"dt", comparison.duration},
              {"instances", comparison.instances},
              {"object_pairs", comparison.object_pairs},
              {"at_start", comparison.at_start},
              {"stopped", comparison.stopped},
              {"in_contact", comparison.in_contact},
              {"peers", std::move(peers)}});
  return report;
}

}  // namespace tandem::bench
