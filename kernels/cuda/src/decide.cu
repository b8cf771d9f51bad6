#include "gpu_query_data.h"
#include "tandem/kernels/detail/candidate.h"

// What the walks left undecided: float64, then exactly. The exact stage needs 3 KB of stack a thread, so it
// has a kernel of its own, which scenes without hard cases leave at once.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

__device__ const Triangle& triangle_a(const PairRecord& record, const Candidate& candidate) {
  return record.triangles_a[candidate.a];
}
__device__ const Triangle& triangle_b(const PairRecord& record, const Candidate& candidate) {
  return record.triangles_b[candidate.b];
}

__device__ TrianglePair posed_pair(const QueryArgs& args, const PairRecord& record,
                                   const Candidate& candidate) {
  return tandem::posed_pair(stored_pose(args, record.instance_a), triangle_a(record, candidate),
                            stored_pose(args, record.instance_b), triangle_b(record, candidate));
}

__device__ std::uint32_t stored(Counter counted, std::uint64_t room) {
  return static_cast<std::uint32_t>(counted < room ? counted : room);
}

/// All lanes of the warp take part.
__device__ void add_contact(const QueryArgs& args, const PairRecord& record, const Candidate& candidate,
                            bool contact) {
  if (contact) contact = is_wanted(args, candidate.pair);
  const Counter place = place_for(contact, &args.state->contacts);
  if (!contact || place >= args.capacity.contacts) return;
  args.contacts[place] =
      make_contact(candidate.pair, record.instance_a == record.instance_b, candidate.a, candidate.b,
                   triangle_a(record, candidate).source_face(), triangle_b(record, candidate).source_face());
}

/// Adds up over the warp.
__device__ void count(bool counts, Counter* counter) {
  const std::uint32_t lanes = __ballot_sync(kAllLanes, counts);
  if (lane_id() == 0 && lanes != 0) atomicAdd(counter, static_cast<Counter>(__popc(lanes)));
}

/// Where only boxes are asked for, nothing comes to the float64 stage.
__host__ __device__ bool has_float64_stage(const QueryArgs& args) {
  return args.mode != QueryMode::boxes && !args.walk_only;
}

/// What other blocks made of it.
__device__ Counter now(const Counter& counter) {
  return *static_cast<const volatile Counter*>(&counter);
}

__device__ void write_report(const QueryArgs& args) {
  const QueryState& state = *args.state;
  const Counter contacts = now(state.contacts), exactly = now(state.unresolved),
                by_float64 = now(state.decided_by_float64);
  const std::uint32_t pairs = *args.given.count;
  GpuQueryReport report = {};
  report.needed = {pairs, contacts, state.undecided};
  report.complete = pairs <= args.given.capacity && pairs <= args.capacity.pairs &&
                    contacts <= args.capacity.contacts && state.undecided <= args.capacity.undecided;
  report.contacts = contacts < args.capacity.contacts ? contacts : args.capacity.contacts;
  report.world_pairs = state.world_pairs;
  QueryCounters& counters = report.counters;
  counters.object_pairs = pair_count(args);
  counters.block_pairs = state.block_pairs;
  counters.candidates = state.candidates;
  counters.decided_by_float64 = by_float64;
  counters.decided_exactly = exactly;
  if (has_float64_stage(args)) counters.decided_by_float32 = state.candidates - by_float64 - exactly;
  counters.contacts = contacts;
  if (state.error != 0) {
    report = {};
    report.status = status_in(state.error);
    report.where = where_in(state.error);
  }
  args.state->report = report;
  *args.host_report = report;
}

// What makes the state ready for the next query; the report stays. Mailboxes: those that this one used.
__device__ void clear_mailboxes(QueryState& state, std::uint32_t mailboxes) {
  for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < mailboxes; i += gridDim.x * kThreads) {
    state.frame.mailbox[i] = state.world.mailbox[i] = 0;
  }
}
__device__ void clear_counters(QueryState& state) {
  for (Balance* balance : {&state.frame, &state.world}) {
    balance->counts = balance->next_pair = 0;
  }
  state.error = state.contacts = state.undecided = state.unresolved = 0;
  state.world_pairs = state.finished_blocks = 0;
  state.block_pairs = state.candidates = state.decided_by_float64 = 0;
}

__device__ void finish(const QueryArgs& args) {
  write_report(args);
  clear_counters(*args.state);
}

/// Whether this is the first thread of the block that comes here last, all others being done.
__device__ bool ends_last(const QueryArgs& args) {
  __threadfence();
  __syncthreads();
  return threadIdx.x == 0 && atomicAdd(&args.state->finished_blocks, 1u) == gridDim.x - 1;
}

/// Finishes the query where nothing is left to the exact stage.
template <bool kFast>
__global__ void __launch_bounds__(kThreads) decide_by_float64(const __grid_constant__ QueryArgs args) {
  wait_for_kernel_before();
  clear_mailboxes(*args.state, args.shape.mailboxes());
  const std::uint32_t total = failed(args) ? 0 : stored(args.state->undecided, args.capacity.undecided);
  for (std::uint32_t first = blockIdx.x * kThreads; first < total; first += gridDim.x * kThreads) {
    const std::uint32_t i = first + threadIdx.x;
    const Candidate candidate = args.undecided[i < total ? i : first];
    const PairRecord& record = args.pairs[candidate.pair];
    Verdict verdict = Verdict::apart;
    bool by_float64 = false;
    if (i < total) {
      if (kFast && record.in_frame != 0) {
        verdict = decide_fast(
            framed_pair(pose_of(record), triangle_a(record, candidate), triangle_b(record, candidate)));
      } else {
        verdict = decide_float64(posed_pair(args, record, candidate));
        by_float64 = verdict != Verdict::undecided;
      }
    }
    count(by_float64, &args.state->decided_by_float64);
    const Counter place = place_for(verdict == Verdict::undecided, &args.state->unresolved);
    if (verdict == Verdict::undecided) args.unresolved[place] = candidate;
    add_contact(args, record, candidate, verdict == Verdict::contact);
  }
  if (!ends_last(args)) return;
  if (now(args.state->unresolved) == 0)
    finish(args);
  else
    args.state->finished_blocks = 0;
}

/// Finishes the query where the float64 stage did not.
__global__ void __launch_bounds__(kThreads) decide_exactly(const __grid_constant__ QueryArgs args) {
  wait_for_kernel_before();
  const auto total = static_cast<std::uint32_t>(args.state->unresolved);
  if (has_float64_stage(args)) {
    if (total == 0) return;
  } else {
    clear_mailboxes(*args.state, args.shape.mailboxes());
  }
  for (std::uint32_t first = blockIdx.x * kThreads; first < total; first += gridDim.x * kThreads) {
    const std::uint32_t i = first + threadIdx.x;
    const Candidate candidate = args.unresolved[i < total ? i : first];
    const PairRecord& record = args.pairs[candidate.pair];
    const bool contact = i < total && decide_exact(posed_pair(args, record, candidate)) == Verdict::contact;
    add_contact(args, record, candidate, contact);
  }
  if (ends_last(args)) finish(args);
}

}  // namespace

cudaError_t decide_rest(const QueryArgs& args, cudaStream_t stream) {
  const Grid grid = {args.limits.processors * 4, kThreads, 0, stream, args.limits.early_launch};
  cudaError_t error = cudaSuccess;
  if (has_float64_stage(args))
    error = launch_after(
        grid, args.mode == QueryMode::fast ? decide_by_float64<true> : decide_by_float64<false>, args);
  return error == cudaSuccess ? launch_after(grid, decide_exactly, args) : error;
}

}  // namespace tandem::gpu
