#include "tandem/kernels/distance_query.h"

#include <algorithm>

#include "kernels/common/check_options.h"
#include "kernels/common/traversal.h"
#include "kernels/distance/pair_distance.h"
#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

// Pairs that a worker takes at a time.
constexpr std::size_t kMostPairsAtOnce = 16;

// Pairs of bodies with more triangles than this, together, are spread over all threads, one after the other.
constexpr std::uint64_t kSpreadFrom = std::uint64_t{1} << 18;

// A walk of such a pair visits so many pairs of blocks before it leaves the rest to others; and so many walks
// make a round, in which none knows what the others find. Threads take them as they come.
constexpr std::uint64_t kVisitsAlone = 2048, kVisitsInRound = 512;
constexpr std::size_t kWalksInRound = 64;

void add_to(DistanceCounters& sum, const DistanceCounters& part) {
  tandem::add_to(
      sum, part,
      {&DistanceCounters::block_pairs, &DistanceCounters::by_float32, &DistanceCounters::by_float64});
}

}  // namespace

struct DistanceQuery::State : Allocated {
  NearestPhase nearest_phase = best_way(tandem::nearest_phase);
  PerWorker<DistanceSearch> slots;  // one for each worker, or for each walk of a round
  DistanceSearch spread;

  // These belong to the call.
  SceneState* scene = nullptr;
  DistanceOptions options;
  std::span<const ObjectPair> pairs;
  ObjectDistance* distances = nullptr;
  DistanceCounters* counters = nullptr;

  bool is_spread(const ObjectPair& pair) const;
  double reach_of(std::size_t pair) const;
  NearestTask task_of(const ObjectPair& pair) const;
  NearestTriangles former_of(const ObjectPair& pair) const;
  void find_one(std::size_t pair, DistanceSearch& search);
  bool walk_round(const NearestTask& task, std::size_t first, DistanceSearch& whole);
  bool find_spread(std::size_t pair);
  Status find_all();
};

bool DistanceQuery::State::is_spread(const ObjectPair& pair) const {
  return pair.a != pair.b && std::uint64_t{scene->bodies[pair.a].tree.triangle_count} +
                                     scene->bodies[pair.b].tree.triangle_count >=
                                 kSpreadFrom;
}

double DistanceQuery::State::reach_of(std::size_t pair) const {
  return options.reach_of_pair.empty() ? options.reach : options.reach_of_pair[pair];
}

NearestTask DistanceQuery::State::task_of(const ObjectPair& pair) const {
  return nearest_task(scene->bodies[pair.a], scene->bodies[pair.b], options.tolerance);
}

// The triangles of the pair that were nearest a step ago; they may not exist.
NearestTriangles DistanceQuery::State::former_of(const ObjectPair& pair) const {
  const auto comes_before = [](const FormerNearest& x, const ObjectPair& y) {
    return x.a != y.a ? x.a < y.a : x.b < y.b;
  };
  const auto former = std::lower_bound(options.former.begin(), options.former.end(), pair, comes_before);
  if (former == options.former.end() || former->a != pair.a || former->b != pair.b) return {};
  return {former->triangle_a, former->triangle_b};
}

void DistanceQuery::State::find_one(std::size_t pair, DistanceSearch& search) {
  const NearestTask task = task_of(pairs[pair]);
  const double reach = reach_of(pair);
  if (pairs[pair].a == pairs[pair].b) {
    search.found.reset(reach);
    settle(task, 0, 0, search.found);
    distances[pair] = search.finish(task, reach);
  } else {
    distances[pair] = search.find(task, reach, former_of(pairs[pair]), nearest_phase);
  }
}

// Walks of which none knows what the others find, whoever takes them; what they found and left, in their
// order.
bool DistanceQuery::State::walk_round(const NearestTask& task, std::size_t first, DistanceSearch& whole) {
  NearestSoFar& state = whole.found;
  const std::size_t count = std::min(whole.walks.size() - first, kWalksInRound);
  const auto walk = [&](std::size_t i, std::size_t end, std::uint32_t) {
    for (; i < end; ++i) {
      NearestSoFar& own = slots[i].found;
      own.reset(INFINITY);
      own.counters = {};
      own.upper = state.upper;
      own.found = state.found;
      own.has_direction = state.has_direction;
      std::copy_n(state.direction, 3, own.direction);
      own.most_visits = kVisitsInRound;
      own.heights = state.heights;
      phase_of(task, nearest_phase)(task, &whole.walks[first + i], 1, own);
    }
  };
  scene->threads->for_parts(scene->workers_for(count, 1), count, 1, walk);
  for (std::size_t i = 0; i < count; ++i) {
    if (!take_over(slots[i].found, state)) return false;
  }
  return true;
}

bool DistanceQuery::State::find_spread(std::size_t pair) {
  NearestSoFar& whole = spread.found;
  whole.counters = {};
  whole.enough_memory = true;
  const NearestTask task = task_of(pairs[pair]);
  spread.begin(task, reach_of(pair), former_of(pairs[pair]));
  whole.most_visits = kVisitsAlone;
  const BoundedBlockPair roots = {0, 0, 0, kAllNodePairs};
  phase_of(task, nearest_phase)(task, &roots, 1, whole);
  while (whole.left.size() > 0 && !whole.touches() && whole.enough_memory) {
    spread.take_left();
    for (std::size_t first = 0; first < spread.walks.size() && !whole.touches(); first += kWalksInRound) {
      if (whole.bounded >= whole.most_bounded) spread.find_heights(task);
      if (!whole.enough_memory || !walk_round(task, first, spread)) return false;
    }
  }
  distances[pair] = spread.finish(task, reach_of(pair));
  add_to(*counters, whole.counters);
  return whole.enough_memory;
}

Status DistanceQuery::State::find_all() {
  const std::uint32_t most = scene->most_workers;
  const std::size_t at_once = std::clamp(pairs.size() / (32 * most), std::size_t{1}, kMostPairsAtOnce);
  const std::uint32_t workers = scene->workers_for(pairs.size(), at_once);
  if (!slots.provide(std::max<std::size_t>(workers, kWalksInRound)))
    return scene->fail(Status::kOutOfMemory, 0);
  if (!scene->threads->provide(most)) return scene->fail(Status::kCannotStartThread, 0);
  for (std::size_t i = 0; i < slots.size(); ++i) slots[i].reset_counters();
  scene->threads->for_parts(workers, pairs.size(), at_once,
                            [&](std::size_t i, std::size_t end, std::uint32_t worker) {
                              for (; i < end; ++i) {
                                if (!is_spread(pairs[i])) find_one(i, slots[worker]);
                              }
                            });
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (!slots[i].found.enough_memory) return scene->fail(Status::kOutOfMemory, 0);
    add_to(*counters, slots[i].found.counters);
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (is_spread(pairs[i]) && !find_spread(i)) return scene->fail(Status::kOutOfMemory, 0);
  }
  return Status::kOk;
}

Status DistanceQuery::check_reaches(SceneState& scene, std::span<const double> of_pair) const {
  if (!of_pair.empty() && of_pair.size() != pairs_.size()) return scene.fail(Status::kBadOption, 0);
  for (std::size_t i = 0; i < of_pair.size(); ++i) {
    if (const Status status = check_reach(of_pair[i]); status != Status::kOk) return scene.fail(status, i);
  }
  return Status::kOk;
}

Status DistanceQuery::answer(SceneState& scene, const std::span<const ObjectPair>* given,
                             const DistanceOptions& options) {
  Status status = check_distance_options(options.tolerance, options.reach);
  if (status != Status::kOk) return scene.fail(status, 0);
  status = scene.take_or_find_pairs(given, options.reach, false, pairs_);
  if (status == Status::kOk) status = check_reaches(scene, options.reach_of_pair);
  if (status != Status::kOk) return status;
  if (scene.device != nullptr) return scene.ask_device(options, found());
  State* const state = state_.provide();
  if (state == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  if (!rows_.resize(pairs_.size())) return scene.fail(Status::kOutOfMemory, 0);
  counters_ = {};
  state->scene = &scene;
  state->options = options;
  state->pairs = pairs_.view();
  state->distances = rows_.data();
  state->counters = &counters_;
  status = state->find_all();
  counters_.object_pairs = pairs_.size();
  for (const ObjectDistance& distance : rows_.view()) counters_.touching += distance.upper == 0;
  return status;
}

}  // namespace tandem
