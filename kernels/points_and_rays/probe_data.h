#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/launch.h"
#include "kernels/common/pair_record.h"
#include "kernels/contact/candidate.h"
#include "kernels/geometry/local_frame.h"
#include "kernels/points_and_rays/body_tree.h"
#include "kernels/scene/body_visit.h"
#include "tandem/kernels/gpu_closest_query.h"
#include "tandem/kernels/gpu_distance_query.h"
#include "tandem/kernels/gpu_ray_query.h"

// The kernels of questions about points and rays, "probes", share this data, all of it in GPU memory.
//
//  1. prepare (prepare_probes.cu): a record for each body, a tree of their world boxes, and the order of the
//     probes, in which neighbours follow each other.
//  2. A walk with a thread for each probe: float32 rules out, float64 decides. A probe for which that is not
//     sure enough is put on a list.
//  3. A walk anew for those on the list, which decides exactly by the code of the CPU.
//  4. Where all hits of rays are asked for: they are put in their order (order_hits.cu).
//
// A probe's answer depends on no other probe, so it is the same on every run.
namespace tandem::gpu {

/// An error about a probe counts as one about what is asked, as a pair is.
inline constexpr Subject kProbe = Subject::pair;

/// A body as probes see it.
struct ProbedBody {
  LocalFrame frame;
  Pose pose;  ///< of stored coordinates
  const Block* blocks;
  const Triangle* triangles;
  const PreciseCorners* precise;
  std::uint32_t asset, spare;
};

/// The closed surfaces of an asset.
struct ProbedSurface {
  const std::uint32_t* labels;  ///< of the triangles; null: all belong to closed components
  std::uint32_t any_closed;
  std::uint32_t spare;
};

/// Numbers that kernels make. Zero when a query begins.
struct ProbeCounts {
  Counter error;  ///< complement of (what, where, status), 0 where there is none: the first wins
  Counter hard;   ///< probes that float64 does not decide
  Counter found;  ///< of all hits: those that were listed, also without room
  Counter blocks, by_float64, hits;
  Counter bounds[6];  ///< of all bodies: complements of the lower ends and the upper ends, as_ordered()
  std::uint32_t words, spare;
};

template <typename Report>
struct ProbeState {
  ProbeCounts counts;
  Report report;
};

/// A hit among all, of no order.
struct ListedHit {
  ray::FoundHit hit;
  std::uint32_t ray;
  std::uint32_t exact;  ///< whether the walk that decides exactly found it
};

/// The arguments of all kernels.
struct ProbeArgs {
  const GpuAsset* assets;
  std::uint32_t asset_count, probe_count;
  GpuInstances instances;
  const std::uint8_t* looked_at;
  DeviceLimits limits;
  ProbeCounts* counts;

  ProbedBody* bodies;
  WorldBox* boxes;
  BoxTree::Group* groups;
  std::uint32_t level_begin[BoxTree::kMostLevels];
  std::int32_t levels;
  std::uint32_t *body_keys, *body_numbers;  ///< twice as many as instances: before and after sorting
  std::uint32_t *probe_keys, *probe_numbers;
  std::uint32_t* hard;  ///< probes
  unsigned char* scratch;
  std::uint64_t scratch_bytes;
};

struct ClosestArgs : ProbeArgs {
  const double* points;
  DistanceTolerance tolerance;
  double reach, beyond_reach;
  bool sides;
  GpuClosestCapacity capacity;
  const ProbedSurface* surfaces;
  ProbeState<GpuClosestReport>* state;
  GpuClosestReport* host_report;  ///< in CPU memory
  ClosestPoint* rows;
};

struct RayArgs : ProbeArgs {
  const double *origins, *directions;
  double reach;
  RayHits wanted;
  GpuRayCapacity capacity;
  ProbeState<GpuRayReport>* state;
  GpuRayReport* host_report;  ///< in CPU memory
  RayHit* rows;

  // These are for all hits alone.
  ListedHit *listed, *ordered;
  std::uint32_t *hits_of, *first_hit, *placed, *by_exact;  ///< of each ray
};

/// The bytes that sorting and adding up need for so many.
cudaError_t probe_scratch_bytes(std::uint32_t instances, std::uint32_t probes, std::size_t& bytes);

/// Sets the levels of the bodies' tree.
void set_levels(ProbeArgs& args);

/// The groups of a tree of so many bodies, at most.
constexpr std::uint64_t groups_of(std::uint64_t bodies) {
  return bodies / 3 + BoxTree::kMostLevels;
}

cudaError_t prepare_points(const ClosestArgs& args, cudaStream_t stream);
cudaError_t prepare_rays(const RayArgs& args, cudaStream_t stream);
cudaError_t find_closest(const ClosestArgs& args, cudaStream_t stream);
cudaError_t find_closest_exactly(const ClosestArgs& args, cudaStream_t stream);
cudaError_t find_sides(const ClosestArgs& args, cudaStream_t stream);
cudaError_t report_closest(const ClosestArgs& args, cudaStream_t stream);
cudaError_t cast_rays(const RayArgs& args, cudaStream_t stream);
cudaError_t cast_rays_exactly(const RayArgs& args, cudaStream_t stream);
cudaError_t order_hits(const RayArgs& args, cudaStream_t stream);
cudaError_t sort_hits(const RayArgs& args, cudaStream_t stream);
cudaError_t cast_rays_of_most_words(const RayArgs& args, cudaStream_t stream);
cudaError_t sort_hits_of_most_words(const RayArgs& args, cudaStream_t stream);

#ifdef __CUDACC__

/// A float64 number as a whole number of the same order, which is not 0 but for NaN.
__device__ inline Counter as_ordered(double x) {
  const auto bits = static_cast<Counter>(__double_as_longlong(x));
  return bits >> 63 != 0 ? ~bits : bits | Counter{1} << 63;
}
__device__ inline double from_ordered(Counter x) {
  return __longlong_as_double(static_cast<long long>(x >> 63 != 0 ? x & ~(Counter{1} << 63) : ~x));
}

/// The box of all bodies; where there are none, some box.
__device__ inline WorldBox bounds_of(const ProbeCounts& counts) {
  WorldBox box = {};
  for (int k = 0; k < 3 && counts.bounds[0] != 0; ++k) {
    box.lo[k] = from_ordered(~counts.bounds[k]);
    box.hi[k] = from_ordered(counts.bounds[3 + k]);
  }
  return box;
}

/// Returns whether there is an answer with all hits.
__device__ inline bool has_room(const RayArgs& args) {
  return args.counts->error == 0 && args.counts->found <= args.capacity.hits;
}

/// Adds what the lanes of a warp counted; all take part.
__device__ inline void add_counts(Counter& sum, Counter part) {
  for (int bit = 1; bit < 32; bit <<= 1) part += __shfl_xor_sync(kAllLanes, part, bit);
  if (lane_id() == 0 && part != 0) atomicAdd(&sum, part);
}

/// The bodies' tree as visit_bodies() takes it.
struct PlacesOfBodies {
  const ProbeArgs& args;

  __device__ std::uint32_t count() const { return args.instances.count; }
  __device__ int top() const { return args.levels - 1; }
  __device__ const BoxTree::Group* level(int i) const { return args.groups + args.level_begin[i]; }
  __device__ std::uint32_t body(std::uint32_t i) const { return args.body_numbers[args.instances.count + i]; }
};

__device__ inline void corners_of(const ProbedBody& body, std::uint32_t triangle, double (&out)[3][3]) {
  pose_corners(body.pose, body.triangles[triangle],
               body.precise != nullptr ? body.precise + triangle : nullptr, out);
}

#endif

}  // namespace tandem::gpu
