#include "tandem/kernels/distance_query.h"

#include <algorithm>
#include <atomic>
#include <new>

#include "kernels/common/instance_check.h"
#include "kernels/common/traversal.h"
#include "kernels/common/worker_threads.h"
#include "kernels/distance/nearest_phase.h"

namespace tandem {
namespace {

// Instances that a worker poses, and pairs that it takes, at a time.
constexpr std::size_t kInstancesAtOnce = 64, kMostPairsAtOnce = 16;

// Pairs of bodies with more triangles than this, together, are spread over all threads, one after the other.
constexpr std::uint64_t kSpreadFrom = std::uint64_t{1} << 18;

// Of such a pair: how many pairs of blocks one walk visits before it leaves the rest to others; and how many
// walks make a round, in which none knows what the others find. Threads take them as they come.
constexpr std::uint64_t kVisitsAlone = 2048, kVisitsInRound = 512;
constexpr std::size_t kWalksInRound = 64;

struct Asset {
  LevelView tree;
  TreeExtent extent;
  double origin[3];
  float lower[3], upper[3];
};

NearestPhase best_nearest_phase() {
  NearestPhase best = nullptr;
  for (const BlockPairVariant variant : kBlockPairVariants) {
    if (const NearestPhase way = nearest_phase(variant); way != nullptr) best = way;
  }
  return best;
}

void add_to(DistanceCounters& sum, const DistanceCounters& part) {
  sum.block_pairs += part.block_pairs;
  sum.by_float32 += part.by_float32;
  sum.by_float64 += part.by_float64;
}

// What the walks of one round may find is kept in slots of their own.
struct alignas(64) Slot : Allocated {
  NearestSoFar state;
};

bool is_near_first(const BoundedBlockPair& x, const BoundedBlockPair& y) {
  if (x.bound != y.bound) return x.bound < y.bound;
  return x.a != y.a ? x.a < y.a : x.b < y.b;
}

}  // namespace

struct DistanceQuery::State : Allocated {
  Buffer<Asset> assets;
  Buffer<PosedTree> instances;
  Buffer<WorldBox> boxes;
  BroadPhase broad_phase;
  Buffer<ObjectPair> given_pairs;
  std::span<const ObjectPair> pairs;  // found or given
  Buffer<ObjectDistance> distances;
  DistanceCounters counters;
  std::uint64_t where = 0;

  NearestPhase nearest_phase = best_nearest_phase();
  DistanceOptions options;
  WorkerThreads threads;
  std::unique_ptr<Slot[]> slots;  // one for each worker, or for each walk of a round
  std::size_t slot_count = 0;
  Buffer<BoundedBlockPair> walks;

  Status fail(Status status, std::uint64_t at) {
    where = at;
    forget_results();
    return status;
  }
  void forget_results() {
    pairs = {};
    distances.clear();
    counters = {};
  }

  std::uint32_t workers_for(std::size_t things, std::size_t at_once) const {
    const std::size_t parts = (things + at_once - 1) / at_once;
    return static_cast<std::uint32_t>(
        std::clamp<std::size_t>(parts, 1, std::clamp(options.threads, 1u, kMostQueryThreads)));
  }
  Status check_options();
  Status pose_instances(std::span<const Instance> posed);
  Status find_pairs();
  Status take_pairs(std::span<const ObjectPair> given);
  bool provide_slots(std::size_t count);
  bool is_spread(const ObjectPair& pair) const;
  NearestTask task_of(const ObjectPair& pair) const;
  void begin(const NearestTask& task, const ObjectPair& pair, NearestSoFar& state) const;
  NearestPhase phase_of(const NearestTask& task) const {
    return task.in_frame ? nearest_phase : nearest_phase_by_world_boxes;
  }
  void find_one(std::size_t pair, NearestSoFar& state);
  bool walk_round(const NearestTask& task, std::size_t first, NearestSoFar& state);
  bool find_spread(std::size_t pair);
  void finish(std::size_t pair, const NearestTask& task, NearestSoFar& state);
  Status find_distances_of_pairs();
};

Status DistanceQuery::State::check_options() {
  const auto fits = [](double x) { return x >= 0; };
  const DistanceTolerance& tolerance = options.tolerance;
  return fits(options.reach) && fits(tolerance.absolute) && fits(tolerance.relative)
             ? Status::kOk
             : fail(Status::kOutOfRange, 0);
}

// Of instances that are refused the first is to blame.
Status DistanceQuery::State::pose_instances(std::span<const Instance> posed) {
  if (posed.size() >= kNoIndex) return fail(Status::kTooManyInstances, 0);
  if (!instances.resize(posed.size()) || !boxes.resize(posed.size())) return fail(Status::kOutOfMemory, 0);
  const auto asset_count = static_cast<std::uint32_t>(std::min<std::size_t>(assets.size(), kNoIndex));
  const auto pose_one = [&](std::size_t i) {
    const Instance& instance = posed[i];
    const Status status =
        pose_instance(assets.data(), asset_count, instance.asset, instance.pose, instances[i].pose, boxes[i]);
    if (status != Status::kOk) return status;
    instances[i].tree = assets[instance.asset].tree;
    instances[i].extent = assets[instance.asset].extent;
    return status;
  };
  const std::uint32_t workers = workers_for(posed.size(), kInstancesAtOnce);
  if (!threads.provide(workers)) return fail(Status::kCannotStartThread, 0);
  std::atomic<std::size_t> refused = posed.size();
  threads.for_parts(workers, posed.size(), kInstancesAtOnce,
                    [&](std::size_t i, std::size_t end, std::uint32_t) {
                      while (i < end && pose_one(i) == Status::kOk) ++i;
                      std::size_t first = refused;
                      while (i < end && i < first && !refused.compare_exchange_weak(first, i)) {
                      }
                    });
  return refused == posed.size() ? Status::kOk : fail(pose_one(refused), refused);
}

Status DistanceQuery::State::find_pairs() {
  // Two boxes that are within reach of each other meet when each is larger by half of it.
  for (WorldBox& box : std::span(boxes.data(), boxes.size())) box = grown(box, 0.5 * options.reach);
  const PairFilter filter = options.filter != nullptr ? *options.filter : PairFilter();
  const Status status = broad_phase.find_pairs(boxes.view(), filter, false, threads,
                                               workers_for(boxes.size(), kInstancesAtOnce));
  if (status != Status::kOk)
    return fail(status, status == Status::kUnknownInstance ? filter.excluded.row : 0);
  pairs = broad_phase.pairs();
  return status;
}

Status DistanceQuery::State::take_pairs(std::span<const ObjectPair> given) {
  if (given.size() >= kNoIndex) return fail(Status::kTooManyPairs, 0);
  if (!given_pairs.resize(given.size())) return fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < given.size(); ++i) {
    const Status status = check_pair(given[i], static_cast<std::uint32_t>(instances.size()));
    if (status != Status::kOk) return fail(status, i);
    given_pairs[i] = given[i];
  }
  pairs = given_pairs.view();
  return Status::kOk;
}

bool DistanceQuery::State::provide_slots(std::size_t count) {
  if (count <= slot_count) return true;
  slots.reset(new (std::nothrow) Slot[count]);
  slot_count = slots != nullptr ? count : 0;
  return slots != nullptr;
}

bool DistanceQuery::State::is_spread(const ObjectPair& pair) const {
  return pair.a != pair.b &&
         std::uint64_t{instances[pair.a].tree.triangle_count} + instances[pair.b].tree.triangle_count >=
             kSpreadFrom;
}

NearestTask DistanceQuery::State::task_of(const ObjectPair& pair) const {
  return nearest_task(instances[pair.a], instances[pair.b], options.tolerance);
}

// Nothing is known but what the former nearest triangles tell.
void DistanceQuery::State::begin(const NearestTask& task, const ObjectPair& pair, NearestSoFar& state) const {
  state.reset(options.reach);
  const auto comes_before = [](const FormerNearest& x, const ObjectPair& y) {
    return x.a != y.a ? x.a < y.a : x.b < y.b;
  };
  const auto former = std::lower_bound(options.former.begin(), options.former.end(), pair, comes_before);
  if (former == options.former.end() || former->a != pair.a || former->b != pair.b) return;
  if (former->triangle_a < task.a->tree.triangle_count && former->triangle_b < task.b->tree.triangle_count)
    settle(task, former->triangle_a, former->triangle_b, state);
}

// The pair's row, of what is left when all candidates are settled.
void DistanceQuery::State::finish(std::size_t pair, const NearestTask& task, NearestSoFar& state) {
  if (!state.touches()) settle_candidates(task, state);
  ObjectDistance& out = distances[pair];
  out = {};
  out.triangle_a = out.triangle_b = out.face_a = out.face_b = kNoIndex;
  // What did not count is not nearer than the upper bound of then, or is beyond reach.
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

void DistanceQuery::State::find_one(std::size_t pair, NearestSoFar& state) {
  const NearestTask task = task_of(pairs[pair]);
  if (pairs[pair].a == pairs[pair].b) {
    state.reset(options.reach);
    settle(task, 0, 0, state);
  } else {
    begin(task, pairs[pair], state);
    const BoundedBlockPair roots = {0, 0, 0, kAllNodePairs};
    phase_of(task)(task, &roots, 1, state);
  }
  finish(pair, task, state);
}

// Walks of which none knows what the others find, whoever takes them; what they found and left, in their
// order.
bool DistanceQuery::State::walk_round(const NearestTask& task, std::size_t first, NearestSoFar& state) {
  const std::size_t count = std::min(walks.size() - first, kWalksInRound);
  const auto walk = [&](std::size_t i, std::size_t end, std::uint32_t) {
    for (; i < end; ++i) {
      NearestSoFar& own = slots[i].state;
      own.reset(INFINITY);
      own.counters = {};
      own.upper = state.upper;
      own.found = state.found;
      own.has_direction = state.has_direction;
      std::copy_n(state.direction, 3, own.direction);
      own.most_visits = kVisitsInRound;
      phase_of(task)(task, &walks[first + i], 1, own);
    }
  };
  threads.for_parts(workers_for(count, 1), count, 1, walk);
  for (std::size_t i = 0; i < count; ++i) {
    if (!take_over(slots[i].state, state)) return false;
  }
  return true;
}

bool DistanceQuery::State::find_spread(std::size_t pair) {
  NearestSoFar whole;
  const NearestTask task = task_of(pairs[pair]);
  begin(task, pairs[pair], whole);
  whole.most_visits = kVisitsAlone;
  const BoundedBlockPair roots = {0, 0, 0, kAllNodePairs};
  phase_of(task)(task, &roots, 1, whole);
  while (whole.left.size() > 0 && !whole.touches() && whole.enough_memory) {
    std::swap(walks, whole.left);
    whole.left.clear();
    std::sort(walks.data(), walks.data() + walks.size(), is_near_first);
    for (std::size_t first = 0; first < walks.size() && !whole.touches(); first += kWalksInRound) {
      if (!walk_round(task, first, whole)) return false;
    }
  }
  finish(pair, task, whole);
  add_to(counters, whole.counters);
  return whole.enough_memory;
}

Status DistanceQuery::State::find_distances_of_pairs() {
  if (!distances.resize(pairs.size())) return fail(Status::kOutOfMemory, 0);
  const std::uint32_t most = std::clamp(options.threads, 1u, kMostQueryThreads);
  const std::size_t at_once = std::clamp(pairs.size() / (32 * most), std::size_t{1}, kMostPairsAtOnce);
  const std::uint32_t workers = workers_for(pairs.size(), at_once);
  if (!provide_slots(std::max<std::size_t>(workers, kWalksInRound))) return fail(Status::kOutOfMemory, 0);
  if (!threads.provide(most)) return fail(Status::kCannotStartThread, 0);
  for (std::size_t i = 0; i < slot_count; ++i) {
    slots[i].state.counters = {};
    slots[i].state.enough_memory = true;
    slots[i].state.most_visits = ~std::uint64_t{0};
  }
  threads.for_parts(workers, pairs.size(), at_once,
                    [&](std::size_t i, std::size_t end, std::uint32_t worker) {
                      for (; i < end; ++i) {
                        if (!is_spread(pairs[i])) find_one(i, slots[worker].state);
                      }
                    });
  counters = {};
  for (std::size_t i = 0; i < slot_count; ++i) {
    if (!slots[i].state.enough_memory) return fail(Status::kOutOfMemory, 0);
    add_to(counters, slots[i].state.counters);
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (is_spread(pairs[i]) && !find_spread(i)) return fail(Status::kOutOfMemory, 0);
  }
  counters.object_pairs = pairs.size();
  for (const ObjectDistance& distance : distances.view()) counters.touching += distance.upper == 0;
  return Status::kOk;
}

DistanceQuery::DistanceQuery() : state_(new (std::nothrow) State) {}
DistanceQuery::DistanceQuery(DistanceQuery&&) noexcept = default;
DistanceQuery& DistanceQuery::operator=(DistanceQuery&&) noexcept = default;
DistanceQuery::~DistanceQuery() = default;

Status DistanceQuery::set_assets(std::span<const AssetView> assets) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  state_->forget_results();
  state_->assets.clear();
  for (std::size_t i = 0; i < assets.size(); ++i) {
    if (assets[i].header == nullptr || assets[i].levels.empty())
      return state_->fail(Status::kUnknownAsset, i);
  }
  if (!state_->assets.resize(assets.size())) return Status::kOutOfMemory;
  for (std::size_t i = 0; i < assets.size(); ++i) {
    Asset& asset = state_->assets[i];
    asset.tree = assets[i].level();
    asset.extent = extent_of(asset.tree.blocks[0]);
    const FileHeader& header = *assets[i].header;
    std::copy_n(header.origin, 3, asset.origin);
    std::copy_n(header.lower, 3, asset.lower);
    std::copy_n(header.upper, 3, asset.upper);
  }
  return Status::kOk;
}

Status DistanceQuery::find_distances(std::span<const Instance> instances, const DistanceOptions& options) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  state_->forget_results();
  state_->options = options;
  Status status = state_->check_options();
  if (status == Status::kOk) status = state_->pose_instances(instances);
  if (status == Status::kOk) status = state_->find_pairs();
  return status == Status::kOk ? state_->find_distances_of_pairs() : status;
}

Status DistanceQuery::find_distances(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                                     const DistanceOptions& options) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  state_->options = options;
  Status status = state_->check_options();
  if (status == Status::kOk) status = state_->pose_instances(instances);
  if (status == Status::kOk) status = state_->take_pairs(pairs);
  return status == Status::kOk ? state_->find_distances_of_pairs() : status;
}

std::span<const ObjectPair> DistanceQuery::pairs() const {
  return state_ != nullptr ? state_->pairs : std::span<const ObjectPair>();
}

std::span<const ObjectDistance> DistanceQuery::distances() const {
  return state_ != nullptr ? state_->distances.view() : std::span<const ObjectDistance>();
}

const DistanceCounters& DistanceQuery::counters() const {
  static constexpr DistanceCounters kNone;
  return state_ != nullptr ? state_->counters : kNone;
}

std::uint64_t DistanceQuery::where() const {
  return state_ != nullptr ? state_->where : 0;
}

}  // namespace tandem
