#include "kernels/contact/contact_finder.h"

#include <algorithm>

#include "kernels/common/block_pair.h"
#include "kernels/common/check_options.h"
#include "kernels/contact/first_contact.h"
#include "kernels/contact/neighbour_lists.h"
#include "kernels/geometry/level_error.h"
#include "tandem/kernels/contact_query.h"

namespace tandem {
namespace {

// Object pairs that a thread takes at a time, where there are enough for every thread to come back often.
constexpr std::size_t kMostPairsInChunk = 16, kChunksForEach = 32;

// Chunks whose contacts a worker copies at a time: some microseconds of work.
constexpr std::size_t kChunksAtOnce = 8;

}  // namespace

bool ContactFinder::grow_contacts(ContactSink& sink) {
  Worker& owner = *static_cast<Worker*>(sink.owner);
  Buffer<Contact>& contacts = owner.contacts;
  const std::size_t used = static_cast<std::size_t>(sink.next - contacts.data());
  if (!contacts.grow(used, owner.workers)) return false;
  sink.next = contacts.data() + used;
  sink.end = contacts.data() + contacts.capacity();
  return true;
}

// No more than there are chunks.
bool ContactFinder::provide_workers(const SceneState& scene) {
  const std::size_t chunks_wanted = kChunksForEach * scene.most_workers;
  pairs_in_chunk_ = std::clamp(pairs_.size() / chunks_wanted, std::size_t{1}, kMostPairsInChunk);
  if (!chunks_.resize((pairs_.size() + pairs_in_chunk_ - 1) / pairs_in_chunk_)) return false;
  active_workers_ = scene.workers_for(chunks_.size(), 1);
  if (!workers_.provide(active_workers_)) return false;
  for (std::uint32_t i = 0; i < active_workers_; ++i) {
    workers_[i].contacts.clear();
    workers_[i].workers = active_workers_;
    workers_[i].counters = {};
    workers_[i].enough_memory = true;
  }
  return true;
}

PairTask ContactFinder::task_of(std::uint32_t pair) const {
  const PosedTree &a = trees_[pairs_[pair].a], &b = trees_[pairs_[pair].b];
  double within = options_.within;
  if (options_.add_error_bounds && &a != &b) within = clearance_of_levels(within, a.error, b.error);
  PairTask task = options_.first_contact_only ? first_contact_task(a, b, within) : pair_task(a, b, within);
  task.pair = pair;
  task.mode = options_.mode;
  return task;
}

// Takes chunks of pairs until none is left. A call that leaves out nothing has code of its own, which does
// not ask.
template <bool kWithoutNeighbours>
void ContactFinder::work(std::uint32_t worker) {
  Worker& self = workers_[worker];
  ContactSink sink;
  sink.owner = &self;
  sink.grow = grow_contacts;
  sink.next = self.contacts.data();
  sink.end = self.contacts.data() + self.contacts.capacity();
  const auto used = [&] { return static_cast<std::size_t>(sink.next - self.contacts.data()); };
  for (;;) {
    const std::uint32_t chunk = next_chunk_.fetch_add(1, std::memory_order_relaxed);
    if (chunk >= chunks_.size() || !self.enough_memory) break;
    const std::size_t begin = used(), first = chunk * pairs_in_chunk_;
    const std::size_t end = std::min(pairs_.size(), first + pairs_in_chunk_);
    for (std::size_t pair = first; pair < end && self.enough_memory; ++pair) {
      PairTask task = task_of(static_cast<std::uint32_t>(pair));
      if constexpr (kWithoutNeighbours) {
        if (task.self) task.neighbours = &neighbours_[pairs_[pair].a];
      }
      self.enough_memory = run_contact_task(task, narrow_phase_, sink, self.waiting);
    }
    chunks_[chunk] = {worker, begin, used(), 0};
  }
  self.counters = sink.counters;
  (void)self.contacts.resize(used());
}

// The contacts of all workers in the order of pairs_.
Status ContactFinder::collect(SceneState& scene, Buffer<Contact>& contacts, ContactCounters& counters) {
  std::size_t total = 0;
  counters = {};
  counters.object_pairs = pairs_.size();
  for (std::uint32_t i = 0; i < active_workers_; ++i) {
    if (!workers_[i].enough_memory) return scene.fail(Status::kOutOfMemory, 0);
    add_to(counters, workers_[i].counters,
           {&ContactCounters::block_pairs, &ContactCounters::candidates, &ContactCounters::decided_by_float32,
            &ContactCounters::decided_by_float64, &ContactCounters::decided_exactly,
            &ContactCounters::contacts});
    total += workers_[i].contacts.size();
  }
  if (active_workers_ == 1) {
    std::swap(contacts, workers_[0].contacts);
    return Status::kOk;
  }
  if (!contacts.resize(total)) return scene.fail(Status::kOutOfMemory, 0);
  std::size_t place = 0;
  for (std::size_t i = 0; i < chunks_.size(); ++i) {
    chunks_[i].place = place;
    place += chunks_[i].end - chunks_[i].begin;
  }
  scene.threads->for_parts(active_workers_, chunks_.size(), kChunksAtOnce,
                           [&](std::size_t i, std::size_t end, std::uint32_t) {
                             for (; i < end; ++i) {
                               const ChunkResult& chunk = chunks_[i];
                               const Contact* from = workers_[chunk.worker].contacts.data();
                               std::copy(from + chunk.begin, from + chunk.end, contacts.data() + chunk.place);
                             }
                           });
  // Which worker takes which chunk is chance: so that no call of the same scene allocates, there is room for
  // all in each.
  for (std::uint32_t i = 0; i < active_workers_; ++i) {
    if (!workers_[i].contacts.resize(total)) break;  // then it will grow when it has to
  }
  return Status::kOk;
}

// A query with error bounds proves something, so it is decided exactly in mode fast too.
Status ContactFinder::find(SceneState& scene, std::span<const PosedTree> trees,
                           std::span<const ObjectPair> pairs, const ContactOptions& options,
                           Buffer<Contact>& contacts, ContactCounters& counters,
                           std::span<const Neighbourhood> neighbours) {
  const bool leaves_out = !neighbours.empty();
  narrow_phase_ = best_way(leaves_out ? narrow_phase_without_neighbours : narrow_phase);
  trees_ = trees;
  pairs_ = pairs;
  neighbours_ = neighbours;
  options_ = options;
  if (options.add_error_bounds && options.mode == QueryMode::fast) options_.mode = QueryMode::exact;
  if (!provide_workers(scene)) return scene.fail(Status::kOutOfMemory, 0);
  if (!scene.threads->provide(active_workers_)) return scene.fail(Status::kCannotStartThread, 0);
  next_chunk_.store(0, std::memory_order_relaxed);
  const auto work = [](void* finder, std::uint32_t worker) {
    static_cast<ContactFinder*>(finder)->work<false>(worker);
  };
  const auto work_without_neighbours = [](void* finder, std::uint32_t worker) {
    static_cast<ContactFinder*>(finder)->work<true>(worker);
  };
  scene.threads->run(active_workers_, leaves_out ? +work_without_neighbours : +work, this);
  return collect(scene, contacts, counters);
}

namespace {

// Result: kOk, or kNoTopology where a body that is to meet itself has none.
Status require_topology_of_selves(SceneState& scene, std::span<const ObjectPair> pairs) {
  for (const ObjectPair& pair : pairs) {
    if (pair.a == pair.b && scene.bodies[pair.a].tree.topology == nullptr)
      return scene.fail(Status::kNoTopology, scene.instances[pair.a].asset);
  }
  return Status::kOk;
}

}  // namespace

struct ContactQuery::State : Allocated {
  ContactFinder finder;
  BodyNeighbours neighbours;
};

Status ContactQuery::answer(SceneState& scene, const std::span<const ObjectPair>* given,
                            const ContactOptions& options) {
  const std::uint32_t rings = options.leave_out_rings;
  Status status = check_within(options.within);
  if (status == Status::kOk) status = check_rings(rings);
  if (status != Status::kOk) return scene.fail(status, 0);
  status = scene.take_or_find_pairs(given, options.within, options.self_pairs, pairs_);
  if (status == Status::kOk && rings > 0) status = require_topology_of_selves(scene, pairs_.view());
  if (status != Status::kOk) return status;
  if (scene.device != nullptr) return scene.ask_device(options, found());
  State* const state = state_.provide();
  if (state == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  if (rings > 0) status = state->neighbours.provide(scene, pairs_.view(), rings);
  if (status != Status::kOk) return status;
  const std::span<const Neighbourhood> left_out =
      rings > 0 ? state->neighbours.view() : std::span<const Neighbourhood>();
  return state->finder.find(scene, scene.bodies.view(), pairs_.view(), options, rows_, counters_, left_out);
}

}  // namespace tandem
