#include "measure.h"

#include <algorithm>
#include <iterator>

#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/contacts_file.h"
#include "levels/level_bytes.h"

namespace tandem::economy {
namespace {

Findings findings_of(const TimedAnswer& answer) {
  Findings found;
  found.object_pairs = answer.pairs.size();
  found.contacts = answer.contacts.size();
  std::vector<bool> touches(answer.pairs.size());
  for (const TriangleContact& contact : answer.contacts) touches[contact.pair] = true;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (touches[i]) found.touching.push_back(answer.pairs[i]);
  }
  for (const Manifold& manifold : answer.manifolds.manifolds) {
    if ((manifold.flags & kAmbiguous) != 0) continue;  // it has no direction
    Patch patch = {answer.pairs[manifold.pair], {}, {}, manifold.depth};
    std::copy_n(manifold.normal, 3, patch.normal.begin());
    std::copy_n(manifold.centre, 3, patch.centre.begin());
    found.patches.push_back(patch);
  }
  return found;
}

}  // namespace

LevelMeasurer::LevelMeasurer(std::string path, const MeasureSettings& settings)
    : path_(std::move(path)), settings_(settings), scene_(bench::read_scene(path_)) {
  std::vector<Instance>& instances = scene_.description.instances;
  for (const Instance& instance : instances) asset_of_.push_back(scene_.shapes[instance.asset].asset);
  std::vector<std::uint32_t> row(scene_.assets.size(), 0);  // of each asset in shapes
  for (const std::uint32_t asset : asset_of_) row[asset] = 1;
  for (std::uint32_t i = 0; i < row.size(); ++i) {
    if (row[i] == 0) continue;
    row[i] = static_cast<std::uint32_t>(used_.size());
    used_.push_back(i);
  }
  for (std::size_t i = 0; i < instances.size(); ++i) instances[i].asset = row[asset_of_[i]];
  use(Levels(scene_.assets.size()));
}

void LevelMeasurer::use(const Levels& levels) {
  scene_.shapes.clear();
  for (const std::uint32_t asset : used_) scene_.shapes.push_back({asset, levels[asset]});
}

std::vector<std::uint32_t> LevelMeasurer::level_counts() const {
  std::vector<std::uint32_t> counts(scene_.assets.size(), 1);
  for (const std::uint32_t asset : used_)
    counts[asset] = static_cast<std::uint32_t>(scene_.assets[asset].view().levels.size());
  return counts;
}

SimulationSettings LevelMeasurer::simulation() const {
  return {settings_.engine, settings_.simulated_seconds, 0, settings_.threads};
}

Measures LevelMeasurer::query(const Levels& levels) {
  const bench::SceneDescription& told = scene_.description;
  const auto pairs = bench::normalised(told.pairs.value_or(std::vector<ObjectPair>()));
  const auto engine = make_engine(settings_.engine);
  engine->set_threads(settings_.threads);
  ExcludedPairTable excluded;
  engine->set_shapes(scene_.views());
  engine->set_filter(told.filter.view(excluded));
  engine->update(told.instances);
  TimedQuery asked;
  asked.given = told.pairs ? &pairs : nullptr;
  asked.repeats = settings_.repeats;
  asked.manifolds = true;
  const TimedAnswer answer = engine->time_query(asked);
  found_ = findings_of(answer);
  gpu_ = answer.gpu.name;
  Measures measures;
  measures.levels = levels;
  for (const std::uint32_t asset : used_)
    measures.bytes += bytes_of_level(scene_.assets[asset].view(), levels[asset]);
  measures.gpu_bytes = answer.gpu.bytes;
  measures.query_seconds = best_of(answer.whole);
  measures.manifold_seconds = best_of(answer.manifolds.seconds);
  measures.object_pairs = found_.object_pairs;
  measures.touching_pairs = found_.touching.size();
  measures.contacts = found_.contacts;
  measures.manifolds = found_.patches.size();
  return measures;
}

Findings LevelMeasurer::changeable(const Findings& found, const Levels& levels) const {
  const auto is_changeable = [&](const ObjectPair& pair) {
    return levels[asset_of_[pair.a]] > 0 || levels[asset_of_[pair.b]] > 0;
  };
  Findings taken;
  std::copy_if(found.touching.begin(), found.touching.end(), std::back_inserter(taken.touching),
               is_changeable);
  std::copy_if(found.patches.begin(), found.patches.end(), std::back_inserter(taken.patches),
               [&](const Patch& patch) { return is_changeable(patch.pair); });
  return taken;
}

const Measures& LevelMeasurer::measure(const Levels& levels) {
  const Levels finest(levels.size());
  if (levels != finest) measure(finest);
  if (const auto known = known_.find(levels); known != known_.end()) return known->second;
  use(levels);
  Measures measures = query(levels);
  if (levels == finest) finest_ = found_;
  measures.change = difference(changeable(finest_, levels), changeable(found_, levels));
  if (settings_.simulated_seconds > 0) {
    const Rest rest = simulate(path_, scene_, simulation());
    if (levels == finest) finest_rest_ = rest;
    measures.rest = {rest.step_seconds, rest.speed, end_distance(finest_rest_, rest)};
  }
  return known_.emplace(levels, std::move(measures)).first->second;
}

const Spread& LevelMeasurer::end_distance_of_a_nudge() {
  if (!nudged_) {
    const Levels finest(scene_.assets.size());
    measure(finest);
    use(finest);
    SimulationSettings settings = simulation();
    settings.nudge = kNudge;
    nudged_ = end_distance(finest_rest_, simulate(path_, scene_, settings));
  }
  return *nudged_;
}

}  // namespace tandem::economy
