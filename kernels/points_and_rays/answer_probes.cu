#include "kernels/points_and_rays/point_answer.cuh"
#include "kernels/points_and_rays/ray_answer.cuh"

// The answers about points and rays as far as float64 decides them, and the report. Compiled without fused
// operations: posed points are those of the CPU.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

/// Decides by float64 with error bounds, or leaves it to the exact walk.
struct ByFloat64 {
  static constexpr bool kExact = false;

  __device__ bool distance(const TrianglePair& pair, const DistanceTolerance& tolerance,
                           TriangleDistance& out) const {
    return point_distance_by_float64(pair, tolerance, out);
  }
  __device__ ray::Answer meets(const WorldRay& ray, const double (&corner)[3][3], ray::Meeting& out) const {
    const ray::Answer answer = ray::find_by_float64(ray::volumes_of(ray.origin, ray.direction, corner), out);
    return answer == ray::Answer::yes ? ray::is_within_by_float64(out, ray.reach) : answer;
  }
  __device__ ray::Answer comes_before(const WorldRay&, const ray::FoundHit& x, const ProbedBody&,
                                      const ray::FoundHit& y, const ProbedBody&) const {
    return ray::comes_before_by_float64(x, y);
  }
};

template <typename Options>
__global__ void __launch_bounds__(kThreads) answer_each(const __grid_constant__ AskedArgs<Options> args) {
  if (args.counts->error != 0) return;
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  auto search = search_for(args);
  bool is_hard = false;
  std::uint32_t number = 0;
  if (i < args.probe_count) {
    number = args.probe_numbers[std::uint64_t{args.probe_count} + i];
    is_hard = !answer(args, number, ByFloat64{}, search);
  }
  const Counter place = place_for(is_hard, &args.counts->hard);
  if (is_hard) args.hard[place] = number;
  add_counts(args, search);
}

__device__ std::uint32_t as_capacity(Counter counted) {
  return static_cast<std::uint32_t>(counted < kNoIndex ? counted : kNoIndex);
}

/// rows: how many there are; kNoIndex: one for each hit.
__global__ void report(const __grid_constant__ ProbeArgs args, std::uint32_t rows) {
  const ProbeCounts& counts = *args.counts;
  GpuProbeReport report = {};
  if (counts.error != 0) {
    report.status = status_in(counts.error);
    report.where = where_in(counts.error);
  } else {
    const std::uint32_t words = counts.words < kFewWords ? kFewWords : counts.words;
    report.needed = {args.instances.count, args.probe_count, as_capacity(counts.found), words};
    report.complete = words <= args.capacity.words && report.needed.hits <= args.capacity.hits;
    if (report.complete != 0) report.rows = rows != kNoIndex ? rows : static_cast<std::uint32_t>(counts.hits);
    report.exact = static_cast<std::uint32_t>(counts.hard);
    report.counters = {args.probe_count, counts.hits, counts.blocks, counts.by_float64};
  }
  args.state->report = report;
  *args.host_report = report;
}

}  // namespace

template <typename Options>
cudaError_t answer_probes(const AskedArgs<Options>& args, cudaStream_t stream) {
  if (args.probe_count == 0) return cudaSuccess;
  answer_each<<<(args.probe_count - 1) / kThreads + 1, kThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

template cudaError_t answer_probes(const PointArgs&, cudaStream_t);
template cudaError_t answer_probes(const RayArgs&, cudaStream_t);

cudaError_t report_probes(const ProbeArgs& args, std::uint32_t rows, cudaStream_t stream) {
  report<<<1, 1, 0, stream>>>(args, rows);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
