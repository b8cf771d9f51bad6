#include "tandem/kernels/distance_query.h"

#include <algorithm>

#include "kernels/common/check_options.h"
#include "kernels/common/traversal.h"
#include "kernels/distance/nearest_phase.h"
#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

// Pairs that a worker takes at a time.
constexpr std::size_t kMostPairsAtOnce = 16;

// Pairs of bodies with more triangles than this, together, are spread over all threads, one after the other.
constexpr std::uint64_t kSpreadFrom = std::uint64_t{1} << 18;

// A walk of a pair ends, so that heights may be found, when it has bounded as many pairs of triangles as this
// part of the triangles, but not before it has bounded so many.
constexpr std::uint64_t kPartBounded = 4, kLeastBounded = 1024;

// A walk of such a pair visits so many pairs of blocks before it leaves the rest to others; and so many walks
// make a round, in which none knows what the others find. Threads take them as they come.
constexpr std::uint64_t kVisitsAlone = 2048, kVisitsInRound = 512;
constexpr std::size_t kWalksInRound = 64;

void add_to(DistanceCounters& sum, const DistanceCounters& part) {
  tandem::add_to(
      sum, part,
      {&DistanceCounters::block_pairs, &DistanceCounters::by_float32, &DistanceCounters::by_float64});
}

bool is_near_first(const BoundedBlockPair& x, const BoundedBlockPair& y) {
  if (x.bound != y.bound) return x.bound < y.bound;
  return x.a != y.a ? x.a < y.a : x.b < y.b;
}

}  // namespace

struct DistanceQuery::State : Allocated {
  // The search for a pair's distance, or one walk of a round.
  struct Search {
    NearestSoFar found;
    NodeHeights heights;
    Buffer<BoundedBlockPair> walks;
  };

  NearestPhase nearest_phase = best_way(tandem::nearest_phase);
  PerWorker<Search> slots;  // one for each worker, or for each walk of a round
  Search spread;

  // These belong to the call.
  SceneState* scene = nullptr;
  DistanceOptions options;
  std::span<const ObjectPair> pairs;
  ObjectDistance* distances = nullptr;
  DistanceCounters* counters = nullptr;

  bool is_spread(const ObjectPair& pair) const;
  NearestTask task_of(const ObjectPair& pair) const;
  void begin(const NearestTask& task, const ObjectPair& pair, NearestSoFar& state) const;
  static void find_heights(const NearestTask& task, Search& search);
  static void take_left(Search& search);
  NearestPhase phase_of(const NearestTask& task) const {
    return task.in_frame ? nearest_phase : nearest_phase_by_world_boxes;
  }
  void find_one(std::size_t pair, Search& search);
  bool walk_round(const NearestTask& task, std::size_t first, Search& whole);
  bool find_spread(std::size_t pair);
  void finish(std::size_t pair, const NearestTask& task, NearestSoFar& state);
  Status find_all();
};

bool DistanceQuery::State::is_spread(const ObjectPair& pair) const {
  return pair.a != pair.b && std::uint64_t{scene->bodies[pair.a].tree.triangle_count} +
                                     scene->bodies[pair.b].tree.triangle_count >=
                                 kSpreadFrom;
}

NearestTask DistanceQuery::State::task_of(const ObjectPair& pair) const {
  return nearest_task(scene->bodies[pair.a], scene->bodies[pair.b], options.tolerance);
}

// Begins with nothing known but what the former nearest triangles tell.
void DistanceQuery::State::begin(const NearestTask& task, const ObjectPair& pair, NearestSoFar& state) const {
  state.reset(options.reach);
  state.most_bounded =
      std::max(kLeastBounded,
               (std::uint64_t{task.a->tree.triangle_count} + task.b->tree.triangle_count) / kPartBounded);
  const auto comes_before = [](const FormerNearest& x, const ObjectPair& y) {
    return x.a != y.a ? x.a < y.a : x.b < y.b;
  };
  const auto former = std::lower_bound(options.former.begin(), options.former.end(), pair, comes_before);
  if (former == options.former.end() || former->a != pair.a || former->b != pair.b) return;
  if (former->triangle_a < task.a->tree.triangle_count && former->triangle_b < task.b->tree.triangle_count)
    settle(task, former->triangle_a, former->triangle_b, state);
}

// Finds heights along the direction of the best, for the rest of the walk, and lets it go on for four times
// as long before that is done again for a better one.
void DistanceQuery::State::find_heights(const NearestTask& task, Search& search) {
  NearestSoFar& state = search.found;
  state.most_bounded = 4 * state.bounded;
  settle_nearest(task, state);
  if (state.touches() || state.triangle_a == kNoIndex) return;
  find_direction(task, state);
  state.enough_memory = search.heights.make(task, state.along);
  state.heights = &search.heights;
}

// Makes what was left the next walks, the nearest first.
void DistanceQuery::State::take_left(Search& search) {
  std::swap(search.walks, search.found.left);
  search.found.left.clear();
  std::sort(search.walks.data(), search.walks.data() + search.walks.size(), is_near_first);
}

// The pair's row, of what is left when all candidates are settled.
void DistanceQuery::State::finish(std::size_t pair, const NearestTask& task, NearestSoFar& state) {
  if (!state.touches()) settle_candidates(task, state);
  ObjectDistance& out = distances[pair];
  out = {};
  out.triangle_a = out.triangle_b = out.face_a = out.face_b = kNoIndex;
  // Pairs of triangles that did not count are not nearer than the upper bound of then, or are beyond
  // reach.
  out.lower = std::min(state.floor, state.upper);
  out.upper = INFINITY;
  if (state.triangle_a == kNoIndex || out.lower > options.reach) return;
  out.upper = state.found ? std::min(state.best.interval.upper, state.upper) : state.best.interval.upper;
  std::copy_n(state.best.point_a, 3, out.point_a);
  std::copy_n(state.best.point_b, 3, out.point_b);
  out.triangle_a = state.triangle_a;
  out.triangle_b = state.triangle_b;
  out.face_a = task.a->tree.triangles[out.triangle_a].source_face();
  out.face_b = task.b->tree.triangles[out.triangle_b].source_face();
}

void DistanceQuery::State::find_one(std::size_t pair, Search& search) {
  const NearestTask task = task_of(pairs[pair]);
  NearestSoFar& state = search.found;
  if (pairs[pair].a == pairs[pair].b) {
    state.reset(options.reach);
    settle(task, 0, 0, state);
  } else {
    begin(task, pairs[pair], state);
    const BoundedBlockPair roots = {0, 0, 0, kAllNodePairs};
    phase_of(task)(task, &roots, 1, state);
    while (state.left.size() > 0 && !state.touches() && state.enough_memory) {
      find_heights(task, search);
      take_left(search);
      if (state.enough_memory)
        phase_of(task)(task, search.walks.data(), static_cast<std::uint32_t>(search.walks.size()), state);
    }
  }
  finish(pair, task, state);
}

// Walks of which none knows what the others find, whoever takes them; what they found and left, in their
// order.
bool DistanceQuery::State::walk_round(const NearestTask& task, std::size_t first, Search& whole) {
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
      phase_of(task)(task, &whole.walks[first + i], 1, own);
    }
  };
  scene->threads.for_parts(scene->workers_for(count, 1), count, 1, walk);
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
  begin(task, pairs[pair], whole);
  whole.most_visits = kVisitsAlone;
  const BoundedBlockPair roots = {0, 0, 0, kAllNodePairs};
  phase_of(task)(task, &roots, 1, whole);
  while (whole.left.size() > 0 && !whole.touches() && whole.enough_memory) {
    take_left(spread);
    for (std::size_t first = 0; first < spread.walks.size() && !whole.touches(); first += kWalksInRound) {
      if (whole.bounded >= whole.most_bounded) find_heights(task, spread);
      if (!whole.enough_memory || !walk_round(task, first, spread)) return false;
    }
  }
  finish(pair, task, whole);
  add_to(*counters, whole.counters);
  return whole.enough_memory;
}

Status DistanceQuery::State::find_all() {
  const std::uint32_t most = scene->most_workers;
  const std::size_t at_once = std::clamp(pairs.size() / (32 * most), std::size_t{1}, kMostPairsAtOnce);
  const std::uint32_t workers = scene->workers_for(pairs.size(), at_once);
  if (!slots.provide(std::max<std::size_t>(workers, kWalksInRound)))
    return scene->fail(Status::kOutOfMemory, 0);
  if (!scene->threads.provide(most)) return scene->fail(Status::kCannotStartThread, 0);
  for (std::size_t i = 0; i < slots.size(); ++i) {
    slots[i].found.counters = {};
    slots[i].found.enough_memory = true;
    slots[i].found.most_visits = ~std::uint64_t{0};
  }
  scene->threads.for_parts(workers, pairs.size(), at_once,
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

Status DistanceQuery::answer(SceneState& scene, const std::span<const ObjectPair>* given,
                             const DistanceOptions& options) {
  Status status = check_distance_options(options.tolerance, options.reach);
  if (status != Status::kOk) return scene.fail(status, 0);
  status = scene.take_or_find_pairs(given, options.reach, false, pairs_);
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
