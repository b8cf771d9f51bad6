#include <cub/block/block_scan.cuh>

#include "kernels/contact/gpu_query_data.h"

// Contacts pair by pair. The contacts of each pair are counted, the counts are added up in one pass, and each
// contact goes to the next place of its pair. Every kernel takes the time for the contacts or pairs that
// there are: their numbers lie in GPU memory.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 256, kBlocksPerProcessor = 8;
constexpr std::uint32_t kPairsPerThread = kPairsPerTile / kThreads;
constexpr std::uint32_t kWordsPerContact = sizeof(Contact) / 4;
static_assert(sizeof(Contact) == 4 * kWordsPerContact && offsetof(Contact, pair) == 0);

/// Adds one to the count of each lane's pair, with one atomic operation for all lanes of the same pair.
/// Result: what the count was before this lane's. All lanes of the warp take part.
__device__ std::uint32_t add_one(std::uint32_t* counts, std::uint32_t spread, bool mine, std::uint32_t pair) {
  const std::uint32_t same = __match_any_sync(kAllLanes, mine ? pair : kNoIndex);
  const std::uint32_t leader = __ffs(static_cast<int>(same)) - 1;
  std::uint32_t before = 0;
  if (mine && lane_id() == leader)
    before = atomicAdd(&counts[pair * spread], static_cast<std::uint32_t>(__popc(same)));
  return __shfl_sync(kAllLanes, before, static_cast<int>(leader)) + __popc(same & lanes_below());
}

/// Calls of(first, count) in each warp, for the contacts of the query, 32 at a time.
template <class Of>
__device__ void each_32_contacts(const QueryArgs& args, Of of) {
  const std::uint64_t contacts = args.state->report.contacts;
  const std::uint64_t step = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x / 32 * 32; first < contacts;
       first += step) {
    of(first, static_cast<std::uint32_t>(contacts - first < 32 ? contacts - first : 32));
  }
}

__global__ void __launch_bounds__(kThreads) count_contacts(const __grid_constant__ QueryArgs args) {
  wait_for_kernel_before();
  const std::uint32_t spread = spread_of(pair_count(args));
  each_32_contacts(args, [&](std::uint64_t first, std::uint32_t count) {
    const bool mine = lane_id() < count;
    add_one(args.grouping.next, spread, mine, mine ? args.contacts[first + lane_id()].pair : 0);
  });
}

// Sums over pairs, by tiles of kPairsPerTile, in one pass (Merrill and Garland 2016, "Single-pass parallel
// prefix scan with decoupled look-back"). Each tile has two words, of contacts and of pairs that have some.
// The two highest bits of a word say what the others are: nothing yet, the tile's own sum, or the sum of all
// tiles up to it. A word says all by itself, so the words need no order in memory. Tiles are taken in
// ascending order, and a tile waits for those before it alone, which blocks that run have taken: so no block
// waits for one that has not begun.
constexpr Counter kOwnSum = Counter{1} << 62, kSumUpToHere = Counter{2} << 62, kSumBits = kOwnSum - 1;

// Sums of pairs count two things at once: those with few contacts count 1, those with more 2^31. reserve()
// sees to it that neither number reaches 2^31.
constexpr std::uint32_t kManyShift = 31;
constexpr Counter kFewBits = (Counter{1} << kManyShift) - 1;

struct Sums {
  Counter contacts, pairs;

  __device__ Sums operator+(const Sums& other) const {
    return {contacts + other.contacts, pairs + other.pairs};
  }
};

__device__ Sums sums_of(std::uint32_t contacts) {
  return {contacts, contacts == 0 ? 0 : contacts <= kFewContacts ? 1 : Counter{1} << kManyShift};
}

__device__ void tell(Counter* words, std::uint32_t tile, Counter word) {
  *static_cast<volatile Counter*>(&words[tile]) = word;
}

/// The sum of all tiles before this one. A warp calls it.
__device__ Counter sum_before(const Counter* words, std::uint32_t tile) {
  Counter sum = 0;
  for (std::uint32_t end = tile;; end -= 32) {
    // Lane l looks at the l-th tile before `end`; before the first there is nothing.
    Counter word = kSumUpToHere;
    do {
      if (lane_id() < end) word = *static_cast<const volatile Counter*>(&words[end - 1 - lane_id()]);
    } while (__any_sync(kAllLanes, word < kOwnSum));
    const std::uint32_t whole = __ballot_sync(kAllLanes, word >= kSumUpToHere);
    const std::uint32_t last = whole == 0 ? 31 : __ffs(static_cast<int>(whole)) - 1;
    Counter part = lane_id() <= last ? word & kSumBits : 0;
    for (int distance = 16; distance > 0; distance /= 2) part += __shfl_xor_sync(kAllLanes, part, distance);
    sum += part;
    if (whole != 0) return sum;
  }
}

/// All threads of the block take part.
__device__ Sums sums_before(const Grouping& grouping, std::uint32_t tile, const Sums& own) {
  __shared__ Counter before[2];
  const std::uint32_t warp = threadIdx.x / 32;
  if (warp < 2) {
    Counter* words = warp == 0 ? grouping.tile_contacts : grouping.tile_pairs;
    const Counter mine = warp == 0 ? own.contacts : own.pairs;
    if (lane_id() == 0) tell(words, tile, (tile == 0 ? kSumUpToHere : kOwnSum) | mine);
    const Counter sum = tile == 0 ? 0 : sum_before(words, tile);
    if (lane_id() == 0) {
      if (tile != 0) tell(words, tile, kSumUpToHere | (sum + mine));
      before[warp] = sum;
    }
  }
  __syncthreads();
  return {before[0], before[1]};
}

/// Turns the counts of a tile's pairs into where their contacts begin, and lists the pairs that have some.
/// The last tile has the place behind the last pair, where all contacts end.
__device__ void make_ranges_of(const QueryArgs& args, std::uint32_t tile, std::uint32_t pairs) {
  using Scan = cub::BlockScan<Sums, kThreads>;
  __shared__ typename Scan::TempStorage scratch;
  const Grouping& grouping = args.grouping;
  const std::uint32_t spread = spread_of(pairs);
  const std::uint32_t first = tile * kPairsPerTile + threadIdx.x * kPairsPerThread;
  std::uint32_t counts[kPairsPerThread];
  Sums sums = {0, 0}, own;
#pragma unroll
  for (std::uint32_t i = 0; i < kPairsPerThread; ++i) {
    counts[i] = first + i < pairs ? grouping.next[(first + i) * spread] : 0;
    sums = sums + sums_of(counts[i]);
  }
  Scan(scratch).ExclusiveScan(
      sums, sums, Sums{0, 0}, [](const Sums& x, const Sums& y) { return x + y; }, own);
  sums = sums_before(grouping, tile, own) + sums;
#pragma unroll
  for (std::uint32_t i = 0; i < kPairsPerThread; ++i) {
    const std::uint32_t pair = first + i, begin = static_cast<std::uint32_t>(sums.contacts);
    const auto few = static_cast<std::uint32_t>(sums.pairs & kFewBits),
               many = static_cast<std::uint32_t>(sums.pairs >> kManyShift);
    if (pair <= pairs) grouping.first_contact[pair] = begin;
    if (pair == pairs) args.state->groups = {pairs, begin, few, many};
    if (pair < pairs) {
      grouping.next[pair * spread] = begin;
      if (counts[i] > kFewContacts)
        grouping.many[many] = pair;
      else if (counts[i] != 0)
        grouping.few[few] = pair;
    }
    sums = sums + sums_of(counts[i]);
  }
}

__global__ void __launch_bounds__(kThreads) make_ranges(const __grid_constant__ QueryArgs args) {
  __shared__ std::uint32_t taken;
  wait_for_kernel_before();
  const std::uint32_t pairs = pair_count(args);
  for (;;) {
    if (threadIdx.x == 0) taken = atomicAdd(&args.state->tiles_taken, 1u);
    __syncthreads();
    const std::uint32_t tile = taken;
    if (tile >= tiles_of(pairs)) return;
    make_ranges_of(args, tile, pairs);
    __syncthreads();  // all have read what the next tile overwrites
  }
}

/// Contacts move as words, 32 at a time, so that those that stay side by side are read and written together.
__global__ void __launch_bounds__(kThreads) move_contacts(const __grid_constant__ QueryArgs args) {
  wait_for_kernel_before();
  const auto* from = reinterpret_cast<const std::uint32_t*>(args.contacts);
  const std::uint32_t spread = spread_of(pair_count(args));
  auto* to = reinterpret_cast<std::uint32_t*>(args.grouping.contacts);
  each_32_contacts(args, [&](std::uint64_t first, std::uint32_t count) {
    std::uint32_t words[kWordsPerContact];
#pragma unroll
    for (std::uint32_t i = 0; i < kWordsPerContact; ++i) {
      const std::uint32_t word = 32 * i + lane_id();
      words[i] = word < kWordsPerContact * count ? from[kWordsPerContact * first + word] : 0;
    }
    const bool mine = lane_id() < count;
    const std::uint32_t place =
        add_one(args.grouping.next, spread, mine, mine ? args.contacts[first + lane_id()].pair : 0);
#pragma unroll
    for (std::uint32_t i = 0; i < kWordsPerContact; ++i) {
      const std::uint32_t word = 32 * i + lane_id(), contact = word / kWordsPerContact;
      const std::uint64_t there = __shfl_sync(kAllLanes, place, static_cast<int>(contact));
      if (contact < count) to[kWordsPerContact * there + word % kWordsPerContact] = words[i];
    }
  });
}

}  // namespace

cudaError_t group_contacts(const QueryArgs& args, cudaStream_t stream) {
  const Grid grid = {args.limits.processors * kBlocksPerProcessor, kThreads, 0, stream,
                     args.limits.early_launch};
  cudaError_t error = launch_after(grid, count_contacts, args);
  if (error == cudaSuccess) error = launch_after(grid, make_ranges, args);
  if (error != cudaSuccess || args.grouping.contacts == nullptr) return error;
  return launch_after(grid, move_contacts, args);
}

}  // namespace tandem::gpu
