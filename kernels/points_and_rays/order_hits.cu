#include <cub/device/device_scan.cuh>

#include "kernels/points_and_rays/probe_data.h"

// All hits are put together ray by ray, and sorted; then the report is made.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

/// Where float64 gave up a ray, the hits count that the exact walk found.
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

__device__ std::uint32_t as_capacity(Counter counted) {
  return static_cast<std::uint32_t>(counted < kNoIndex ? counted : kNoIndex);
}

__global__ void report(const __grid_constant__ RayArgs args) {
  const ProbeCounts& counts = *args.counts;
  const bool all = args.wanted == RayHits::all;
  GpuRayReport report = {};
  if (counts.error != 0) {
    report.status = status_in(counts.error);
    report.where = where_in(counts.error);
  } else {
    const std::uint32_t words = counts.words < kFewWords ? kFewWords : counts.words;
    report.needed = {args.instances.count, args.probe_count, as_capacity(counts.found), words};
    report.complete = words <= args.capacity.words && report.needed.hits <= args.capacity.hits;
    if (report.complete != 0) report.rows = all ? static_cast<std::uint32_t>(counts.hits) : args.probe_count;
    report.exact = static_cast<std::uint32_t>(counts.hard);
    report.counters = {args.probe_count, counts.hits, counts.blocks, counts.by_float64};
  }
  args.state->report = report;
  *args.host_report = report;
}

cudaError_t put_in_order(const RayArgs& args, cudaStream_t stream) {
  std::size_t bytes = args.scratch_bytes;
  cudaError_t error = cudaMemsetAsync(args.hits_of + args.probe_count, 0, sizeof(std::uint32_t), stream);
  if (error == cudaSuccess) {
    error = cub::DeviceScan::ExclusiveSum(args.scratch, bytes, args.hits_of, args.first_hit,
                                          std::uint64_t{args.probe_count} + 1, stream);
  }
  if (error != cudaSuccess) return error;
  place<<<args.limits.processors * 8, kThreads, 0, stream>>>(args);
  error = cudaGetLastError();
  return error == cudaSuccess ? sort_hits(args, stream) : error;
}

}  // namespace

cudaError_t order_hits(const RayArgs& args, cudaStream_t stream) {
  cudaError_t error = cudaSuccess;
  if (args.wanted == RayHits::all && args.probe_count != 0) error = put_in_order(args, stream);
  if (error != cudaSuccess) return error;
  report<<<1, 1, 0, stream>>>(args);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
