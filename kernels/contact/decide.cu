#include "kernels/contact/candidate.h"
#include "kernels/contact/gpu_query_data.h"
#include "kernels/contact/walk.cuh"

// One kernel decides what the walk of the records leaves, and ends the query: candidates that float32 cannot
// decide, and object pairs that float32 cannot take.
//
// Candidates are decided by float64 as they lie in the list. What float64 leaves waits in shared memory until
// each thread of the block has one to decide exactly. Object pairs that float32 cannot take are walked by
// world boxes; they are rare, so each of their candidates is decided on the spot.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kMostThreads = 32 * kMostWarpsPerBlock;
constexpr std::uint32_t kFewestAtOnce = 8;  // candidates of a warp: few are spread over all warps

__device__ std::uint32_t stored(Counter counted, std::uint64_t room) {
  return static_cast<std::uint32_t>(counted < room ? counted : room);
}

/// All lanes of the warp take part.
__device__ void add_contact(const QueryArgs& args, const PairRecord& record, const Candidate& candidate,
                            bool contact) {
  if (contact) contact = is_wanted(args, candidate.pair);
  const Counter place = place_for(contact, &args.state->contacts);
  if (!contact || place >= args.capacity.contacts) return;
  args.contacts[place] = make_contact(candidate.pair, record.instance_a == record.instance_b, candidate.a,
                                      candidate.b, record.triangles_a[candidate.a].source_face(),
                                      record.triangles_b[candidate.b].source_face());
}

/// Adds up over the warp.
__device__ void count(bool counts, Counter* counter) {
  const std::uint32_t lanes = __ballot_sync(kAllLanes, counts);
  if (lane_id() == 0 && lanes != 0) atomicAdd(counter, static_cast<Counter>(__popc(lanes)));
}

/// Decides the list of candidates; all threads of a block call each function. Mode: exact or fast.
template <QueryMode kMode>
class Deciding {
 public:
  /// The candidates that wait lie where the stacks of the walk by world boxes will be.
  __device__ Deciding(const QueryArgs& args, float4* memory)
      : args_(args),
        waiting_(*reinterpret_cast<std::uint32_t*>(memory)),
        queue_(reinterpret_cast<Candidate*>(memory) + kBlockWords * 4 / sizeof(Candidate) + 1) {
    static_assert(2 * 32 * sizeof(Candidate) + sizeof(Candidate) <= 4 * kWarpWords);
  }

  __device__ void run() {
    const std::uint32_t total = stored(args_.state->undecided, args_.capacity.undecided);
    if (total == 0) return;
    if (threadIdx.x == 0) waiting_ = 0;
    __syncthreads();
    const std::uint32_t warps = gridDim.x * (blockDim.x / 32),
                        at_once = min(max((total + warps - 1) / warps, kFewestAtOnce), 32u);
    const std::uint32_t own = at_once * (threadIdx.x / 32 * gridDim.x + blockIdx.x) + lane_id();
    for (std::uint64_t before = 0; before < total; before += at_once * warps) {
      decide(lane_id() < at_once && before + own < total, static_cast<std::uint32_t>(before + own));
      __syncthreads();
      const bool full = waiting_ >= blockDim.x;
      __syncthreads();  // all have looked before more wait
      if (full) decide_waiting(blockDim.x);
    }
    if (waiting_ != 0) decide_waiting(waiting_);
  }

 private:
  /// Decides by float64, or as mode fast does.
  __device__ void decide(bool mine, std::uint32_t i) {
    const Candidate candidate = args_.undecided[mine ? i : 0];
    const PairRecord& record = args_.pairs[candidate.pair];
    Verdict verdict = Verdict::apart;
    if (mine) {
      verdict = kMode == QueryMode::fast
                    ? decide_fast(framed_pair(pose_of(record), record.triangles_a[candidate.a],
                                              record.triangles_b[candidate.b]))
                    : decide_float64(posed_pair(args_, record, candidate.a, candidate.b));
    }
    if (kMode == QueryMode::exact) {
      count(mine && verdict != Verdict::undecided, &args_.state->decided_by_float64);
      if (verdict == Verdict::undecided) queue_[atomicAdd(&waiting_, 1u)] = candidate;
    }
    add_contact(args_, record, candidate, verdict == Verdict::contact);
  }

  /// Exactly, the last of those that wait. Few are spread over all warps. Condition: some wait.
  __device__ void decide_waiting(std::uint32_t how_many) {
    const std::uint32_t first = waiting_ - how_many, i = lane_id() * (blockDim.x / 32) + threadIdx.x / 32;
    const bool mine = i < how_many;
    const Candidate candidate = queue_[first + (mine ? i : 0)];
    const PairRecord& record = args_.pairs[candidate.pair];
    const bool contact = mine && decide_exactly(posed_pair(args_, record, candidate.a, candidate.b));
    add_contact(args_, record, candidate, contact);
    __syncthreads();  // all have read what is overwritten from now on
    if (threadIdx.x == 0) {
      waiting_ = first;
      atomicAdd(&args_.state->decided_exactly, static_cast<Counter>(how_many));
    }
    __syncthreads();
  }

  const QueryArgs& args_;
  std::uint32_t& waiting_;  // in shared memory; less than the block has threads, but for a moment twice these
  Candidate* queue_;
};

/// Decides candidates of clearance by float32, then float64, then exactly, each stage as soon as the block's
/// threads all have a candidate. The result is exact in mode fast too.
class NearDeciding {
 public:
  __device__ NearDeciding(const QueryArgs& args, float4* memory)
      : args_(args), waiting_(reinterpret_cast<std::uint32_t*>(memory)) {
    static_assert(kStages * 2 * 32 * sizeof(Candidate) <= 4 * kWarpWords + 4 * kEntryWords * kFewestEntries);
    for (int i = 0; i < kStages; ++i)
      queue_[i] = reinterpret_cast<Candidate*>(memory + kBlockWords / 4) + i * 2 * blockDim.x;
  }

  __device__ void run() {
    const std::uint32_t total = stored(args_.state->undecided, args_.capacity.undecided);
    if (total == 0) return;
    if (threadIdx.x < kStages) waiting_[threadIdx.x] = 0;
    __syncthreads();
    const std::uint32_t warps = gridDim.x * (blockDim.x / 32),
                        at_once = min(max((total + warps - 1) / warps, kFewestAtOnce), 32u);
    const std::uint32_t own = at_once * (threadIdx.x / 32 * gridDim.x + blockIdx.x) + lane_id();
    for (std::uint64_t before = 0; before < total; before += at_once * warps) {
      const bool mine = lane_id() < at_once && before + own < total;
      by_float32(mine, args_.undecided[mine ? before + own : 0]);
      settle(blockDim.x);
    }
    settle(1);
  }

 private:
  static constexpr int kStages = 2;  // that candidates wait for

  /// Takes stages that so many candidates wait for, at least, in the end with those that are left.
  __device__ void settle(std::uint32_t least) {
    while (wait_for(0, least)) {
      by_float64();
      while (wait_for(1, blockDim.x)) exactly();
    }
    while (wait_for(1, least)) exactly();
  }

  __device__ bool wait_for(int stage, std::uint32_t least) const {
    __syncthreads();  // all are there
    const bool enough = waiting_[stage] >= least;
    __syncthreads();  // all have looked before that changes
    return enough;
  }

  __device__ void by_float32(bool mine, const Candidate& candidate) {
    const PairRecord& record = args_.pairs[candidate.pair];
    bool contact = false;
    if (mine) {
      const TriangleInFrame a = stored_triangle(record.triangles_a[candidate.a]),
                            b = posed_triangle(pose_of(record), record.triangles_b[candidate.b]);
      const auto verdicts = distance::decide_within(a.corner, b.corner, args_.clearances[candidate.pair]);
      contact = verdicts.contact;
      if (verdicts.undecided) put(0, candidate);
    }
    add_contact(args_, record, candidate, contact);
  }

  __device__ void by_float64() {
    Candidate candidate;
    const bool mine = take(0, candidate);
    const PairRecord& record = args_.pairs[candidate.pair];
    Verdict verdict = Verdict::apart;
    if (mine) {
      verdict = distance::decide_within_float64(posed_pair(args_, record, candidate.a, candidate.b),
                                                clearance_of(args_, record.instance_a, record.instance_b));
      if (verdict == Verdict::undecided) put(1, candidate);
    }
    count(mine && verdict != Verdict::undecided, &args_.state->decided_by_float64);
    add_contact(args_, record, candidate, verdict == Verdict::contact);
  }

  __device__ void exactly() {
    Candidate candidate;
    const bool mine = take(1, candidate);
    const PairRecord& record = args_.pairs[candidate.pair];
    const bool contact =
        mine && are_within_exactly(args_, record, posed_pair(args_, record, candidate.a, candidate.b));
    count(mine, &args_.state->decided_exactly);
    add_contact(args_, record, candidate, contact);
  }

  /// Stores a candidate; one thread calls it.
  __device__ void put(int stage, const Candidate& candidate) {
    queue_[stage][atomicAdd(&waiting_[stage], 1u)] = candidate;
  }

  /// Takes the last of those that wait, one a thread; few are spread over all warps. False: there is none for
  /// this thread, and the candidate is any. Condition: some wait.
  __device__ bool take(int stage, Candidate& candidate) {
    const std::uint32_t all = waiting_[stage], how_many = min(all, blockDim.x);
    const std::uint32_t i = lane_id() * (blockDim.x / 32) + threadIdx.x / 32;
    candidate = queue_[stage][all - how_many + (i < how_many ? i : 0)];
    __syncthreads();  // all have read what is overwritten from now on
    if (threadIdx.x == 0) waiting_[stage] = all - how_many;
    return i < how_many;
  }

  const QueryArgs& args_;
  std::uint32_t* waiting_;  // of each stage; less than the block has threads, but for a moment twice these
  Candidate* queue_[kStages];
};

/// Returns what other blocks made of a counter.
__device__ Counter now(const Counter& counter) {
  return *static_cast<const volatile Counter*>(&counter);
}

__device__ void write_report(const QueryArgs& args) {
  const QueryState& state = *args.state;
  const Counter contacts = now(state.contacts), exactly = now(state.decided_exactly),
                by_float64 = now(state.decided_by_float64), candidates = now(state.candidates);
  const std::uint32_t pairs = *args.given.count;
  GpuContactReport report = {};
  report.needed = {pairs, contacts, state.undecided};
  report.complete = pairs <= args.given.capacity && pairs <= args.capacity.pairs &&
                    contacts <= args.capacity.contacts && state.undecided <= args.capacity.undecided;
  report.contacts = contacts < args.capacity.contacts ? contacts : args.capacity.contacts;
  report.world_pairs = state.world_pairs;
  ContactCounters& counters = report.counters;
  counters.object_pairs = pair_count(args);
  counters.block_pairs = now(state.block_pairs);
  counters.candidates = candidates;
  counters.decided_by_float64 = by_float64;
  counters.decided_exactly = exactly;
  if (args.mode != QueryMode::boxes && !args.walk_only)
    counters.decided_by_float32 = candidates - by_float64 - exactly;
  counters.contacts = contacts;
  if (state.error != 0) {
    report = {};
    report.status = status_in(state.error);
    report.where = where_in(state.error);
  }
  args.state->report = report;
  *args.host_report = report;
}

// These functions make the state ready for the next query; the report stays. mailboxes: those that this query
// used.
__device__ void clear_mailboxes(Balance& balance, std::uint32_t first, std::uint32_t step,
                                std::uint32_t mailboxes) {
  for (std::uint32_t i = first; i < mailboxes; i += step) balance.mailbox[i] = 0;
}
__device__ void clear_counters(QueryState& state) {
  for (Balance* balance : {&state.frame, &state.world}) {
    balance->counts = balance->next_pair = 0;
  }
  state.error = state.contacts = state.undecided = state.decided_exactly = 0;
  state.world_pairs = state.finished_blocks = 0;
  state.block_pairs = state.candidates = state.decided_by_float64 = 0;
}

/// Returns whether the block comes here last, all others being done. word: in shared memory.
__device__ bool ends_last(const QueryArgs& args, std::uint32_t& word) {
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) word = atomicAdd(&args.state->finished_blocks, 1u) == gridDim.x - 1;
  __syncthreads();
  return word != 0;
}

/// kNear: of a query of clearance.
template <QueryMode kMode, bool kWalksOnly, bool kNear>
__global__ void __launch_bounds__(kMostThreads, 1) decide(const __grid_constant__ QueryArgs args) {
  extern __shared__ float4 memory[];
  wait_for_kernel_before();
  QueryState& state = *args.state;
  const std::uint32_t mailboxes = args.shape.shares ? args.shape.mailboxes() : 0;
  clear_mailboxes(state.frame, blockIdx.x * blockDim.x + threadIdx.x, gridDim.x * blockDim.x, mailboxes);
  const bool walks_world = !failed(args) && state.world_pairs != 0;
  if constexpr (kMode != QueryMode::boxes && !kWalksOnly) {
    using Way = std::conditional_t<kNear, NearDeciding, Deciding<kMode>>;
    if (!failed(args)) Way(args, memory).run();
  }
  if (walks_world) {
    __syncthreads();
    prepare_memory(memory);
    run_walk<InWorld<kMode, kWalksOnly, kNear>, true>(args, memory);
  }
  if (!ends_last(args, *reinterpret_cast<std::uint32_t*>(memory))) return;
  if (walks_world) clear_mailboxes(state.world, threadIdx.x, blockDim.x, args.shape.mailboxes());
  if (threadIdx.x != 0) return;
  write_report(args);
  clear_counters(state);
}

template <bool kNear>
cudaError_t launch_decide(const QueryArgs& args, cudaStream_t stream) {
  if (args.walk_only) return launch_shaped(decide<QueryMode::exact, true, kNear>, args, stream);
  switch (args.mode) {
    case QueryMode::exact:
      return launch_shaped(decide<QueryMode::exact, false, kNear>, args, stream);
    case QueryMode::fast:
      return launch_shaped(decide<QueryMode::fast, false, kNear>, args, stream);
    case QueryMode::boxes:
      return launch_shaped(decide<QueryMode::boxes, false, kNear>, args, stream);
  }
  return cudaErrorInvalidValue;
}

}  // namespace

cudaError_t decide_rest(const QueryArgs& args, cudaStream_t stream) {
  return args.near ? launch_decide<true>(args, stream) : launch_decide<false>(args, stream);
}

}  // namespace tandem::gpu
