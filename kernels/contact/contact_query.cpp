#include "tandem/kernels/contact_query.h"

#include <algorithm>
#include <atomic>
#include <new>

#include "kernels/common/block_pair.h"
#include "kernels/common/instance_check.h"
#include "kernels/common/worker_threads.h"
#include "kernels/contact/narrow_phase.h"
#include "kernels/geometry/grid_test.h"
#include "kernels/geometry/level_error.h"

namespace tandem {
namespace {

// Object pairs that a thread takes at a time, where there are enough for every thread to come back often.
constexpr std::size_t kMostPairsInChunk = 16, kChunksForEach = 32;

// Instances that a worker poses, and chunks whose contacts it copies, at a time: some microseconds of work.
constexpr std::size_t kInstancesAtOnce = 64, kChunksAtOnce = 8;

struct Asset {
  LevelView tree;
  TreeExtent extent;
  double grid;
  double origin[3];
  float lower[3], upper[3];
};

// The contacts of one chunk within those of the worker that took it.
struct ChunkResult {
  std::uint32_t worker;
  std::size_t begin, end;
  std::size_t place;  // among the contacts of all
};

struct alignas(64) Worker : Allocated {
  Buffer<Contact> contacts;
  std::uint32_t workers = 1;  // of this call
  ContactCounters counters;
  bool enough_memory = true;
};

bool grow_contacts(ContactSink& sink) {
  Worker& owner = *static_cast<Worker*>(sink.owner);
  Buffer<Contact>& contacts = owner.contacts;
  const std::size_t used = static_cast<std::size_t>(sink.next - contacts.data());
  if (!contacts.grow(used, owner.workers)) return false;
  sink.next = contacts.data() + used;
  sink.end = contacts.data() + contacts.capacity();
  return true;
}

NarrowPhase best_narrow_phase() {
  NarrowPhase best = nullptr;
  for (const BlockPairVariant variant : kBlockPairVariants) {
    if (const NarrowPhase way = narrow_phase(variant); way != nullptr) best = way;
  }
  return best;
}

void add_to(ContactCounters& sum, const ContactCounters& part) {
  sum.object_pairs += part.object_pairs;
  sum.block_pairs += part.block_pairs;
  sum.candidates += part.candidates;
  sum.decided_by_float32 += part.decided_by_float32;
  sum.decided_by_float64 += part.decided_by_float64;
  sum.decided_exactly += part.decided_exactly;
  sum.contacts += part.contacts;
}

}  // namespace

struct ContactQuery::State : Allocated {
  Buffer<Asset> assets;
  Buffer<PosedTree> instances;
  Buffer<WorldBox> boxes;
  BroadPhase broad_phase;
  Buffer<ObjectPair> given_pairs;
  std::span<const ObjectPair> pairs;  // found or given
  Buffer<Contact> contacts;
  ContactCounters counters;
  std::uint64_t where = 0;

  NarrowPhase narrow_phase = best_narrow_phase();
  ContactOptions options;
  WorkerThreads threads;
  std::unique_ptr<Worker[]> workers;
  std::uint32_t worker_count = 0;    // that there are
  std::uint32_t active_workers = 0;  // in this call
  std::size_t pairs_in_chunk = 1;
  Buffer<ChunkResult> chunks;
  std::atomic<std::uint32_t> next_chunk;

  Status fail(Status status, std::uint64_t at) {
    where = at;
    forget_results();
    return status;
  }

  void forget_results() {
    pairs = {};
    contacts.clear();
    counters = {};
  }

  // What adds error bounds proves something, so it is decided exactly in mode fast too.
  void take(const ContactOptions& asked) {
    options = asked;
    if (options.add_error_bounds && options.mode == QueryMode::fast) options.mode = QueryMode::exact;
  }

  std::uint32_t most_workers() const { return std::clamp(options.threads, 1u, kMostQueryThreads); }
  std::uint32_t workers_for(std::size_t things, std::size_t at_once) const;
  Status pose_from(std::span<const Instance> posed, std::size_t& i, std::size_t end);
  Status pose_instances(std::span<const Instance> posed);
  void grow_boxes(std::size_t count);
  Status find_pairs();
  Status take_pairs(std::span<const ObjectPair> given);
  Status find_contacts_of_pairs();
  bool provide_workers();
  PairTask task_of(std::uint32_t pair) const;
  void work(std::uint32_t worker);
  Status collect();
};

// As many as asked for, but no more than find something to do.
std::uint32_t ContactQuery::State::workers_for(std::size_t things, std::size_t at_once) const {
  const std::size_t parts = (things + at_once - 1) / at_once;
  return static_cast<std::uint32_t>(std::clamp<std::size_t>(parts, 1, most_workers()));
}

// Poses of stored coordinates, and world boxes, from instance i on, of those that are not kept. i: the end,
// or the first that is refused; by place among them.
Status ContactQuery::State::pose_from(std::span<const Instance> posed, std::size_t& i, std::size_t end) {
  const auto asset_count = static_cast<std::uint32_t>(std::min<std::size_t>(assets.size(), kNoIndex));
  for (; i < end; ++i) {
    const std::uint32_t at = broad_phase.free_box(i);
    const Instance& instance = posed[at];
    const Status status = pose_instance(assets.data(), asset_count, instance.asset, instance.pose,
                                        instances[at].pose, boxes[at]);
    if (status != Status::kOk) return status;
    const Asset& asset = assets[instance.asset];
    instances[at].tree = asset.tree;
    instances[at].extent = asset.extent;
    instances[at].grid = asset.grid;
    instances[at].error = posed_level_error(asset.tree, asset.lower, asset.upper, instances[at].pose);
  }
  return Status::kOk;
}

// Every part ends with its own first instance that is refused; the first of these is to blame. What is kept
// of instances stays, because there are as many as before.
Status ContactQuery::State::pose_instances(std::span<const Instance> posed) {
  if (!(options.within >= 0 && options.within <= kLargestWorldCoordinate))
    return fail(Status::kOutOfRange, 0);
  if (posed.size() >= kNoIndex) return fail(Status::kTooManyInstances, 0);
  if (broad_phase.kept_of() != 0 && broad_phase.kept_of() != posed.size())
    return fail(Status::kKeptMismatch, 0);
  if (!instances.resize(posed.size()) || !boxes.resize(posed.size())) return fail(Status::kOutOfMemory, 0);
  const std::size_t count = broad_phase.free_count(posed.size());
  const std::uint32_t posing = workers_for(count, kInstancesAtOnce);
  if (!threads.provide(posing)) return fail(Status::kCannotStartThread, 0);
  std::atomic<std::size_t> first_refused = count;
  const auto pose_part = [&](std::size_t i, std::size_t end, std::uint32_t) {
    if (pose_from(posed, i, end) == Status::kOk) return;
    std::size_t first = first_refused;
    while (i < first && !first_refused.compare_exchange_weak(first, i)) {
    }
  };
  threads.for_parts(posing, count, kInstancesAtOnce, pose_part);
  std::size_t refused = first_refused;
  const Status status = pose_from(posed, refused, std::min(refused + 1, count));
  return status == Status::kOk ? status : fail(status, broad_phase.free_box(refused));
}

// Boxes within reach of each other meet when each is larger by half of it; or one by all of it where the
// other is kept, which is kept for any reach. Errors of levels need no more: a world box is made of bounds
// that hold all levels, the finest one too, which is what the query is about.
void ContactQuery::State::grow_boxes(std::size_t count) {
  if (!(options.within > 0)) return;
  const double margin = broad_phase.kept_of() != 0 ? options.within : 0.5 * options.within;
  for (std::size_t i = 0; i < count; ++i) {
    WorldBox& box = boxes[broad_phase.free_box(i)];
    box = grown(box, margin);
  }
}

Status ContactQuery::State::find_pairs() {
  const PairFilter filter = options.filter != nullptr ? *options.filter : PairFilter();
  const std::size_t count = broad_phase.free_count(boxes.size());
  grow_boxes(count);
  const Status status = broad_phase.find_pairs(boxes.view(), filter, options.self_pairs, threads,
                                               workers_for(count, kInstancesAtOnce));
  if (status != Status::kOk)
    return fail(status, status == Status::kUnknownInstance ? filter.excluded.row : 0);
  pairs = broad_phase.pairs();
  return status;
}

Status ContactQuery::State::take_pairs(std::span<const ObjectPair> given) {
  if (!given_pairs.resize(given.size())) return fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < given.size(); ++i) {
    const Status status = check_pair(given[i], static_cast<std::uint32_t>(instances.size()));
    if (status != Status::kOk) return fail(status, i);
    given_pairs[i] = given[i];
  }
  pairs = given_pairs.view();
  return Status::kOk;
}

// No more than there are chunks. Those that there are stay.
bool ContactQuery::State::provide_workers() {
  const std::size_t chunks_wanted = kChunksForEach * most_workers();
  pairs_in_chunk = std::clamp(pairs.size() / chunks_wanted, std::size_t{1}, kMostPairsInChunk);
  if (!chunks.resize((pairs.size() + pairs_in_chunk - 1) / pairs_in_chunk)) return false;
  active_workers = workers_for(chunks.size(), 1);
  if (active_workers > worker_count) {
    workers.reset(new (std::nothrow) Worker[active_workers]);
    worker_count = workers != nullptr ? active_workers : 0;
    if (workers == nullptr) return false;
  }
  for (std::uint32_t i = 0; i < active_workers; ++i) {
    workers[i].contacts.clear();
    workers[i].workers = active_workers;
    workers[i].counters = {};
    workers[i].enough_memory = true;
  }
  return true;
}

PairTask ContactQuery::State::task_of(std::uint32_t pair) const {
  const PosedTree &a = instances[pairs[pair].a], &b = instances[pairs[pair].b];
  double within = options.within;
  if (options.add_error_bounds && &a != &b) within = clearance_of_levels(within, a.error, b.error);
  PairTask task = pair_task(a, b, within);
  task.pair = pair;
  task.mode = options.mode;
  task.first_contact_only = options.first_contact_only;
  return task;
}

// Takes chunks of pairs until none is left.
void ContactQuery::State::work(std::uint32_t worker) {
  Worker& self = workers[worker];
  ContactSink sink;
  sink.owner = &self;
  sink.grow = grow_contacts;
  sink.next = self.contacts.data();
  sink.end = self.contacts.data() + self.contacts.capacity();
  const auto used = [&] { return static_cast<std::size_t>(sink.next - self.contacts.data()); };
  for (;;) {
    const std::uint32_t chunk = next_chunk.fetch_add(1, std::memory_order_relaxed);
    if (chunk >= chunks.size() || !self.enough_memory) break;
    const std::size_t begin = used(), first = chunk * pairs_in_chunk;
    const std::size_t end = std::min(pairs.size(), first + pairs_in_chunk);
    for (std::size_t pair = first; pair < end && self.enough_memory; ++pair) {
      const PairTask task = task_of(static_cast<std::uint32_t>(pair));
      self.enough_memory = (task.in_frame ? narrow_phase : narrow_phase_by_world_boxes)(task, sink);
    }
    chunks[chunk] = {worker, begin, used(), 0};
  }
  self.counters = sink.counters;
  (void)self.contacts.resize(used());
}

// The contacts of all workers in the order of pairs.
Status ContactQuery::State::collect() {
  std::size_t total = 0;
  counters = {};
  counters.object_pairs = pairs.size();
  for (std::uint32_t i = 0; i < active_workers; ++i) {
    if (!workers[i].enough_memory) return fail(Status::kOutOfMemory, 0);
    add_to(counters, workers[i].counters);
    total += workers[i].contacts.size();
  }
  if (active_workers == 1) {
    std::swap(contacts, workers[0].contacts);
    return Status::kOk;
  }
  if (!contacts.resize(total)) return fail(Status::kOutOfMemory, 0);
  std::size_t place = 0;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    chunks[i].place = place;
    place += chunks[i].end - chunks[i].begin;
  }
  threads.for_parts(active_workers, chunks.size(), kChunksAtOnce,
                    [&](std::size_t i, std::size_t end, std::uint32_t) {
                      for (; i < end; ++i) {
                        const ChunkResult& chunk = chunks[i];
                        const Contact* from = workers[chunk.worker].contacts.data();
                        std::copy(from + chunk.begin, from + chunk.end, contacts.data() + chunk.place);
                      }
                    });
  // Which worker takes which chunk is chance: so that no call of the same scene allocates, there is room for
  // all in each.
  for (std::uint32_t i = 0; i < active_workers; ++i) {
    if (!workers[i].contacts.resize(total)) break;  // then it will grow when it has to
  }
  return Status::kOk;
}

Status ContactQuery::State::find_contacts_of_pairs() {
  if (pairs.size() >= kNoIndex) return fail(Status::kOutOfRange, 0);
  if (!provide_workers()) return fail(Status::kOutOfMemory, 0);
  if (!threads.provide(active_workers)) return fail(Status::kCannotStartThread, 0);
  next_chunk.store(0, std::memory_order_relaxed);
  const auto work = [](void* state, std::uint32_t worker) { static_cast<State*>(state)->work(worker); };
  threads.run(active_workers, work, this);
  return collect();
}

ContactQuery::ContactQuery() : state_(new (std::nothrow) State) {}
ContactQuery::ContactQuery(ContactQuery&&) noexcept = default;
ContactQuery& ContactQuery::operator=(ContactQuery&&) noexcept = default;
ContactQuery::~ContactQuery() = default;

Status ContactQuery::set_assets(std::span<const AssetView> assets) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  state_->forget_results();
  state_->broad_phase.forget_fixed();
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
    asset.grid = grid_of(asset.tree, asset.extent);
    const FileHeader& header = *assets[i].header;
    for (int k = 0; k < 3; ++k) {
      asset.origin[k] = header.origin[k];
      asset.lower[k] = header.lower[k];
      asset.upper[k] = header.upper[k];
    }
  }
  return Status::kOk;
}

Status ContactQuery::keep_fixed(std::span<const Instance> instances, std::span<const Motion> motion,
                                const ContactOptions& options) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  State& state = *state_;
  state.forget_results();
  state.broad_phase.forget_fixed();
  state.take(options);
  if (const Status status = state.pose_instances(instances); status != Status::kOk) return status;
  const Status status = state.broad_phase.keep_fixed(state.boxes.view(), motion, state.threads,
                                                     state.workers_for(instances.size(), kInstancesAtOnce));
  return status == Status::kOk ? status : state.fail(status, 0);
}

Status ContactQuery::find_pairs(std::span<const Instance> instances, const ContactOptions& options) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  state_->forget_results();
  state_->take(options);
  const Status status = state_->pose_instances(instances);
  return status == Status::kOk ? state_->find_pairs() : status;
}

Status ContactQuery::find_contacts(std::span<const Instance> instances, const ContactOptions& options) {
  const Status status = find_pairs(instances, options);
  return status == Status::kOk ? state_->find_contacts_of_pairs() : status;
}

Status ContactQuery::find_contacts(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                                   const ContactOptions& options) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  state_->take(options);
  Status status = state_->pose_instances(instances);
  if (status == Status::kOk) status = state_->take_pairs(pairs);
  return status == Status::kOk ? state_->find_contacts_of_pairs() : status;
}

std::span<const ObjectPair> ContactQuery::pairs() const {
  return state_ != nullptr ? state_->pairs : std::span<const ObjectPair>();
}

std::span<const Contact> ContactQuery::contacts() const {
  return state_ != nullptr ? state_->contacts.view() : std::span<const Contact>();
}

const ContactCounters& ContactQuery::counters() const {
  static constexpr ContactCounters kNone;
  return state_ != nullptr ? state_->counters : kNone;
}

std::uint64_t ContactQuery::where() const {
  return state_ != nullptr ? state_->where : 0;
}

}  // namespace tandem
