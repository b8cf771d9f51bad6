#include "kernels/points_and_rays/closest_walk.cuh"

// Closest points as far as float64 decides them. Compiled without fused operations: posed points are those of
// the CPU.
namespace tandem::gpu {
namespace {

struct ByFloat64 {
  __device__ bool operator()(const TrianglePair& pair, const DistanceTolerance& tolerance,
                             TriangleDistance& out) const {
    return point_distance_by_float64(pair, tolerance, out);
  }
};

__global__ void __launch_bounds__(kClosestThreads) find(const __grid_constant__ ClosestArgs args) {
  if (args.counts->error != 0) return;
  const std::uint32_t i = blockIdx.x * kClosestThreads + threadIdx.x;
  ClosestSearch search;
  bool is_hard = false;
  std::uint32_t number = 0;
  if (i < args.probe_count) {
    number = args.probe_numbers[std::uint64_t{args.probe_count} + i];
    is_hard = !find_row(args, number, ByFloat64{}, search);
  }
  const Counter place = place_for(is_hard, &args.counts->hard);
  if (is_hard) args.hard[place] = number;
  add_counts(args.counts->blocks, search.blocks);
  add_counts(args.counts->by_float64, search.by_float64);
}

__global__ void report(const __grid_constant__ ClosestArgs args) {
  const ProbeCounts& counts = *args.counts;
  GpuClosestReport report = {};
  if (counts.error != 0) {
    report.status = status_in(counts.error);
    report.where = where_in(counts.error);
  } else {
    const std::uint32_t words = counts.words < kFewWords ? kFewWords : counts.words;
    report.needed = {args.instances.count, args.probe_count, words};
    report.complete = words <= args.capacity.words;
    report.exact = static_cast<std::uint32_t>(counts.hard);
    report.counters = {args.probe_count, counts.blocks, counts.by_float64};
  }
  args.state->report = report;
  *args.host_report = report;
}

}  // namespace

cudaError_t find_closest(const ClosestArgs& args, cudaStream_t stream) {
  if (args.probe_count == 0) return cudaSuccess;
  const std::uint32_t blocks = (args.probe_count - 1) / kClosestThreads + 1;
  find<<<blocks, kClosestThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

cudaError_t report_closest(const ClosestArgs& args, cudaStream_t stream) {
  report<<<1, 1, 0, stream>>>(args);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
