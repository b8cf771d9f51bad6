#include "kernels/points_and_rays/closest_walk.cuh"

// The closest points that float64 left, anew, by whole numbers. Compiled without fused operations.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 64, kBlocksPerProcessor = 8;

/// The distance by whole numbers of so many words; where more are needed, that is noted, and the query is not
/// complete. Its code takes KBs of stack and stands once.
template <int kWords>
struct Exactly {
  std::uint32_t& words;

  __device__ __noinline__ bool operator()(const TrianglePair& pair, const DistanceTolerance& tolerance,
                                          TriangleDistance& out) const {
    if (point_distance_by_float64(pair, tolerance, out)) return true;
    if (!find_distance<kWords>(pair, tolerance, out))
      atomicMax(&words, static_cast<std::uint32_t>(exact::exponents_of(pair).words()));
    return true;
  }
};

template <int kWords>
__global__ void __launch_bounds__(kThreads) find(const __grid_constant__ ClosestArgs args) {
  if (args.counts->error != 0) return;
  const std::uint64_t count = args.counts->hard, step = std::uint64_t{gridDim.x} * kThreads;
  const Exactly<kWords> decide = {args.counts->words};
  ClosestSearch search;
  for (std::uint64_t i = blockIdx.x * kThreads + threadIdx.x; i < count; i += step)
    find_row(args, args.hard[i], decide, search);
  add_counts(args.counts->blocks, search.blocks);
  add_counts(args.counts->by_float64, search.by_float64);
}

}  // namespace

cudaError_t find_closest_exactly(const ClosestArgs& args, cudaStream_t stream) {
  if (args.probe_count == 0) return cudaSuccess;
  const std::uint32_t blocks = args.limits.processors * kBlocksPerProcessor;
  if (args.capacity.words <= kFewWords)
    find<static_cast<int>(kFewWords)><<<blocks, kThreads, 0, stream>>>(args);
  else
    find<detail::kMaxWords><<<blocks, kThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
