#include "kernels/points_and_rays/ray_walk.cuh"

// The hits of rays as far as float64 decides them, and the report. Compiled without fused operations: posed
// points are those of the CPU.
namespace tandem::gpu {
namespace {

struct ByFloat64 {
  static constexpr bool kExact = false;

  __device__ ray::Answer meets(const WorldRay& ray, const double (&corner)[3][3], ray::Meeting& out) const {
    const ray::Answer answer = ray::find_by_float64(ray::volumes_of(ray.origin, ray.direction, corner), out);
    return answer == ray::Answer::yes ? ray::is_within_by_float64(out, ray.reach) : answer;
  }
  __device__ ray::Answer comes_before(const WorldRay&, const ray::FoundHit& x, const ProbedBody&,
                                      const ray::FoundHit& y, const ProbedBody&) const {
    return ray::comes_before_by_float64(x, y);
  }
};

__global__ void __launch_bounds__(kRayThreads) cast(const __grid_constant__ RayArgs args) {
  if (args.counts->error != 0) return;
  const std::uint32_t i = blockIdx.x * kRayThreads + threadIdx.x;
  RaySearch search;
  bool is_hard = false;
  Counter hits = 0;
  std::uint32_t number = 0;
  if (i < args.probe_count) {
    number = args.probe_numbers[std::uint64_t{args.probe_count} + i];
    is_hard = !find_hits(args, number, ByFloat64{}, search);
    if (args.wanted == RayHits::all) {
      args.by_exact[number] = is_hard ? 1 : 0;
      args.hits_of[number] = is_hard ? 0 : search.hits;
      args.placed[number] = 0;
      hits = is_hard ? 0 : search.hits;
    } else {
      hits = !is_hard && search.found ? 1 : 0;
    }
  }
  const Counter place = place_for(is_hard, &args.counts->hard);
  if (is_hard) args.hard[place] = number;
  add_search(args, search, hits);
}

}  // namespace

cudaError_t cast_rays(const RayArgs& args, cudaStream_t stream) {
  if (args.probe_count == 0) return cudaSuccess;
  cast<<<(args.probe_count - 1) / kRayThreads + 1, kRayThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
