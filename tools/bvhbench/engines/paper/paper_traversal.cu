#include <thrust/iterator/transform_iterator.h>

#include <cub/device/device_scan.cuh>

#include "kernels/contact/leaf_planes.h"
#include "kernels/geometry/box_test.h"
#include "paper_engine_data.h"

// The kernels of a level, and the first stage of the triangle test. nvcc may fuse multiplies and adds here:
// the proofs of the box tests (docs/box_test.md) and of the first stage (frame_test.h) allow it.
namespace tandem::bench::paper {
namespace {

constexpr std::uint32_t kPairsOfBlock = kThreads / kThreadsOfPair;
constexpr std::uint32_t kFloat4s = sizeof(Block) / sizeof(float4);  // of a block of nodes
static_assert(2 * kFloat4s == kThreadsOfPair, "a float4 of either block for each thread");

// A block as words.
constexpr std::uint32_t kHalfExtent = offsetof(Block, half_extent) / sizeof(float);
constexpr std::uint32_t kKind0 = offsetof(Block, kind) / sizeof(float);
constexpr auto kLeafKind = static_cast<std::uint32_t>(NodeKind::leaf);

using gpu::pose_of;

/// The place of a thread's two flags.
template <PaperFlags kKind>
struct Flags {
  __device__ static void write(std::uint32_t* flags, std::uint64_t thread, std::uint64_t threads, bool flag) {
    if constexpr (kKind == PaperFlags::bits) {
      const std::uint32_t lanes = __ballot_sync(kAllLanes, flag);
      if (thread % 32 == 0 && thread < threads) flags[thread / 32] = lanes;
      if (thread == 0) flags[(threads + 31) / 32] = 0;
    } else {
      if (thread < threads) flags[thread] = flag;
      if (thread == 0) flags[threads] = 0;  // its prefix sum is the total
    }
  }

  /// Returns whether it is set; if so, its number among those that are.
  __device__ static bool read(const std::uint32_t* flags, const std::uint32_t* sums, std::uint64_t thread,
                              std::uint32_t& number) {
    if constexpr (kKind == PaperFlags::bits) {
      const std::uint32_t lanes = flags[thread / 32], below = lanes_below();
      if ((lanes & (below + 1)) == 0) return false;
      number = sums[thread / 32] + __popc(lanes & below);
      return true;
    } else {
      if (flags[thread] == 0) return false;
      number = sums[thread];
      return true;
    }
  }
};

/// 16 threads a block pair. Each fetches a float4 of one of the blocks, then tests node i of a against node
/// j of b, 4 i + j being its number. Where one block is a leaf block, the other descends, and of the threads
/// whose internal node is the same the first that hits sets the flag, so that no pair is added twice (the
/// paper's figure 3).
template <PaperFlags kKind>
__global__ void __launch_bounds__(kThreads) collide_level(const __grid_constant__ Level level) {
  // One float4 more than is used: so the two block pairs of a warp lie in different banks.
  __shared__ float4 nodes[kPairsOfBlock][2 * kFloat4s + 1];
  const std::uint32_t slot = threadIdx.x / kThreadsOfPair, lane = threadIdx.x % kThreadsOfPair;
  const std::uint32_t number = blockIdx.x * kPairsOfBlock + slot;
  const bool active = number < level.count;
  const Entry pair = level.pairs[active ? number : 0];
  const PairRecord& record = level.records[pair.pair];
  const Block* block = lane < kFloat4s ? record.blocks_a + pair.a : record.blocks_b + pair.b;
  nodes[slot][lane] = __ldg(reinterpret_cast<const float4*>(block) + lane % kFloat4s);
  __syncwarp();

  const auto* a = reinterpret_cast<const float*>(nodes[slot]);
  const auto* b = reinterpret_cast<const float*>(nodes[slot] + kFloat4s);
  const std::uint32_t i = lane / 4, j = lane % 4;
  Box box_a, box_b;
  for (std::uint32_t k = 0; k < 3; ++k) {
    box_a.centre[k] = a[4 * k + i], box_a.half_extent[k] = a[kHalfExtent + 4 * k + i];
    box_b.centre[k] = b[4 * k + j], box_b.half_extent[k] = b[kHalfExtent + 4 * k + j];
  }
  const bool leaf_a = __float_as_uint(a[kKind0]) == kLeafKind,
             leaf_b = __float_as_uint(b[kKind0]) == kLeafKind;
  const RelativePose pose = pose_of(record);
  const bool overlaps = active && overlap_15_axes(box_a, box_b, pose);
  std::uint32_t mask = __ballot_sync(kAllLanes, overlaps) >> (threadIdx.x % 32 - lane) & kAllNodePairs;
  if (record.instance_a == record.instance_b && pair.a == pair.b) mask &= own_node_pairs(leaf_a);
  const bool hit = (mask >> lane & 1u) != 0;
  const std::uint32_t hits = mask & ((1u << lane) - 1);
  bool collision = hit && !(leaf_a && leaf_b);
  if (leaf_b && !leaf_a) collision = hit && (hits >> 4 * i) == 0;          // none before in i's row
  if (leaf_a && !leaf_b) collision = hit && (hits & (0x1111u << j)) == 0;  // none before in j's column
  const std::uint64_t thread = static_cast<std::uint64_t>(blockIdx.x) * kThreads + threadIdx.x;
  const std::uint64_t threads = static_cast<std::uint64_t>(level.count) * kThreadsOfPair;
  Flags<kKind>::write(level.flags[kCollision], thread, threads, collision);
  Flags<kKind>::write(level.flags[kLeaf], thread, threads, hit && leaf_a && leaf_b);
}

/// A thread for each flag: which node pair it stands for follows from its number, so that the flag is all
/// that the collision kernel had to write.
template <PaperFlags kKind>
__global__ void __launch_bounds__(kThreads)
    collect_level(const __grid_constant__ Level level, Entry* next, Entry* candidates) {
  const std::uint64_t thread = static_cast<std::uint64_t>(blockIdx.x) * kThreads + threadIdx.x;
  if (thread >= static_cast<std::uint64_t>(level.count) * kThreadsOfPair) return;
  std::uint32_t place = 0;
  const bool leaf = Flags<kKind>::read(level.flags[kLeaf], level.sums[kLeaf], thread, place);
  if (!leaf && !Flags<kKind>::read(level.flags[kCollision], level.sums[kCollision], thread, place)) return;
  const Entry pair = level.pairs[thread / kThreadsOfPair];
  const PairRecord& record = level.records[pair.pair];
  const Block &a = record.blocks_a[pair.a], &b = record.blocks_b[pair.b];
  const std::uint32_t below_a = a.index[thread % 16 / 4], below_b = b.index[thread % 4];
  if (leaf) {
    candidates[place] = {pair.pair, below_a, below_b};
  } else {
    next[place] = {pair.pair, a.is_leaf_block() ? pair.a : below_a, b.is_leaf_block() ? pair.b : below_b};
  }
}

struct CountBits {
  __device__ std::uint32_t operator()(std::uint32_t word) const { return __popc(word); }
};

template <typename Iterator>
cudaError_t scan_array(Iterator flags, std::uint32_t* sums, std::size_t count, void* scratch,
                       std::size_t& bytes, cudaStream_t stream) {
  return cub::DeviceScan::ExclusiveScan(scratch, bytes, flags, sums, cuda::std::plus<std::uint32_t>(),
                                        std::uint32_t{0}, static_cast<std::int64_t>(count), stream);
}

template <bool kBounded>
__global__ void __launch_bounds__(kThreads)
    decide_candidates(const __grid_constant__ QueryArgs args,
                      const __grid_constant__ TriangleArgs triangles) {
  const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * kThreads + threadIdx.x;
  const bool mine = i < triangles.count;
  const Entry candidate = triangles.candidates[mine ? i : 0];
  const PairRecord& record = args.records[candidate.pair];
  const RelativePose pose = pose_of(record);
  const TriangleInFrame in_a = stored_triangle(record.triangles_a[candidate.a]),
                        of_b = posed_triangle(pose, record.triangles_b[candidate.b]);
  const auto verdicts =
      frame::decide<kBounded>(in_a.corner, of_b.corner, kBounded ? record.frame_error : 0.0f);
  const bool undecided = mine && verdicts.undecided;
  const Counter place = place_for(undecided, &args.outcome->undecided);
  if (undecided && place < triangles.undecided_room) triangles.undecided[place] = candidate;
  add_contact(args, triangles, candidate, mine && verdicts.contact);
}

__global__ void __launch_bounds__(kThreads)
    take_all(const __grid_constant__ QueryArgs args, const __grid_constant__ TriangleArgs triangles) {
  const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * kThreads + threadIdx.x;
  const bool mine = i < triangles.count;
  add_contact(args, triangles, triangles.candidates[mine ? i : 0], mine);
}

unsigned blocks_for(std::uint64_t threads) {
  return static_cast<unsigned>((threads + kThreads - 1) / kThreads);
}

}  // namespace

cudaError_t collide(const Level& level, PaperFlags kind, cudaStream_t stream) {
  const auto kernel =
      kind == PaperFlags::words ? collide_level<PaperFlags::words> : collide_level<PaperFlags::bits>;
  kernel<<<blocks_for(std::uint64_t{level.count} * kThreadsOfPair), kThreads, 0, stream>>>(level);
  return cudaGetLastError();
}

cudaError_t scan(const Level& level, PaperFlags kind, void* scratch, std::size_t& scratch_bytes,
                 cudaStream_t stream) {
  const std::size_t count = sum_count(kind, level.count);
  for (const FlagArray array : {kCollision, kLeaf}) {
    const std::uint32_t* words = level.flags[array];
    std::uint32_t* sums = level.sums[array];
    const cudaError_t error = kind == PaperFlags::words
                                  ? scan_array(words, sums, count, scratch, scratch_bytes, stream)
                                  : scan_array(thrust::make_transform_iterator(words, CountBits()), sums,
                                               count, scratch, scratch_bytes, stream);
    if (error != cudaSuccess || scratch == nullptr) return error;
  }
  return cudaSuccess;
}

cudaError_t collect(const Level& level, PaperFlags kind, Entry* next, Entry* candidates,
                    cudaStream_t stream) {
  const auto kernel =
      kind == PaperFlags::words ? collect_level<PaperFlags::words> : collect_level<PaperFlags::bits>;
  kernel<<<blocks_for(std::uint64_t{level.count} * kThreadsOfPair), kThreads, 0, stream>>>(level, next,
                                                                                           candidates);
  return cudaGetLastError();
}

cudaError_t decide_by_float32(const QueryArgs& args, const TriangleArgs& triangles, QueryMode mode,
                              cudaStream_t stream) {
  const auto kernel = mode == QueryMode::exact  ? decide_candidates<true>
                      : mode == QueryMode::fast ? decide_candidates<false>
                                                : take_all;
  kernel<<<blocks_for(triangles.count), kThreads, 0, stream>>>(args, triangles);
  return cudaGetLastError();
}

}  // namespace tandem::bench::paper
