#include <cub/device/device_scan.cuh>

#include "kernels/points_and_rays/probe_data.h"

// All hits are put together ray by ray, and sorted.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

/// Puts the hits of each ray side by side. Where float64 gave up a ray, those of the exact walk count.
__global__ void __launch_bounds__(kThreads) place(const __grid_constant__ RayArgs args) {
  if (!has_room(args)) return;
  const std::uint64_t count = args.counts->found, step = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t i = blockIdx.x * kThreads + threadIdx.x; i < count; i += step) {
    const ListedHit& listed = args.listed[i];
    if (listed.exact != args.by_exact[listed.ray]) continue;
    const std::uint32_t rank = atomicAdd(&args.placed[listed.ray], 1u);
    args.ordered[args.first_hit[listed.ray] + rank] = listed;
  }
}

}  // namespace

cudaError_t order_hits(const RayArgs& args, cudaStream_t stream) {
  if (args.asked.hits != RayHits::all || args.probe_count == 0) return cudaSuccess;
  std::size_t bytes = args.scratch_bytes;
  cudaError_t error = cudaMemsetAsync(args.hits_of + args.probe_count, 0, sizeof(std::uint32_t), stream);
  if (error == cudaSuccess) {
    error = cub::DeviceScan::ExclusiveSum(args.scratch, bytes, args.hits_of, args.first_hit,
                                          std::uint64_t{args.probe_count} + 1, stream);
  }
  if (error != cudaSuccess) return error;
  place<<<args.limits.processors * 8, kThreads, 0, stream>>>(args);
  error = cudaGetLastError();
  if (error != cudaSuccess) return error;
  return with_words(args, [&](auto words) { return sort_hits_by_words<words>(args, stream); });
}

}  // namespace tandem::gpu
