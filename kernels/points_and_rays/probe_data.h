#pragma once
#include <cuda_runtime.h>

#include <cstdint>
#include <type_traits>

#include "kernels/common/launch.h"
#include "kernels/common/pair_record.h"
#include "kernels/contact/candidate.h"
#include "kernels/geometry/local_frame.h"
#include "kernels/points_and_rays/body_tree.h"
#include "kernels/scene/body_visit.h"
#include "tandem/kernels/gpu_distance_query.h"
#include "tandem/kernels/gpu_probe_query.h"

// The kernels of questions about points and rays, "probes", share this data, all of it in GPU memory.
//
//  1. prepare_probes.cu makes a record for each body, a tree of their world boxes, and the order of the
//     probes, in which neighbours follow each other.
//  2. answer_probes.cu searches with a thread for each probe: float32 rules out, float64 decides. A probe for
//     which that is not sure enough is put on a list.
//  3. answer_by_few_words.cu, or answer_by_most_words.cu, searches anew for those on the list, and decides
//     exactly by the code of the CPU.
//  4. find_sides.cu finds the sides of points, and order_hits.cu puts all hits of rays in their order, where
//     these are asked for.
//
// What a point and a ray do alike is written once, for the arguments AskedArgs of either. What they do each
// in its own way, the search of a probe through all bodies, is a function of the same name in
// point_answer.cuh and ray_answer.cuh. A probe's answer depends on no other probe, so it is the same on every
// run.
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

struct ProbeState {
  ProbeCounts counts;
  GpuProbeReport report;
};

/// A row of either question: a query keeps the rows of its last call alone.
union ProbeRow {
  ClosestPoint point;
  RayHit hit;
};

/// A hit among all, of no order.
struct ListedHit {
  ray::FoundHit hit;
  std::uint32_t ray;
  std::uint32_t exact;  ///< whether the walk that decides exactly found it
};

/// The arguments that kernels have whatever is asked.
struct ProbeArgs {
  const GpuAsset* assets;
  std::uint32_t asset_count, probe_count;
  GpuInstances instances;
  DeviceLimits limits;
  GpuProbeCapacity capacity;
  ProbeCounts* counts;
  ProbeState* state;
  GpuProbeReport* host_report;  ///< in CPU memory

  const ProbedSurface* surfaces;  ///< of the assets
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

  // These are for all hits of rays alone.
  ListedHit *listed, *ordered;
  std::uint32_t *hits_of, *first_hit, *placed, *by_exact;  ///< of each ray
};

/// The arguments of a question with these options.
template <typename Options>
struct AskedArgs : ProbeArgs {
  Options asked;
  typename Options::Row* rows;
};
using PointArgs = AskedArgs<GpuClosestOptions>;
using RayArgs = AskedArgs<GpuRayOptions>;

/// The bytes that sorting and adding up need for so many.
cudaError_t probe_scratch_bytes(std::uint32_t instances, std::uint32_t probes, std::size_t& bytes);

/// Sets the levels of the bodies' tree.
void set_levels(ProbeArgs& args);

/// The groups of a tree of so many bodies, at most.
constexpr std::uint64_t groups_of(std::uint64_t bodies) {
  return bodies / 3 + BoxTree::kMostLevels;
}

// The steps of a question, in their order.
template <typename Options>
cudaError_t prepare_probes(const AskedArgs<Options>& args, cudaStream_t stream);
template <typename Options>
cudaError_t answer_probes(const AskedArgs<Options>& args, cudaStream_t stream);
template <int kWords, typename Options>
cudaError_t answer_by_words(const AskedArgs<Options>& args, cudaStream_t stream);
cudaError_t find_sides(const PointArgs& args, cudaStream_t stream);
cudaError_t order_hits(const RayArgs& args, cudaStream_t stream);
cudaError_t report_probes(const ProbeArgs& args, std::uint32_t rows, cudaStream_t stream);

/// Sorts the hits of each ray, and makes their rows.
template <int kWords>
cudaError_t sort_hits_by_words(const RayArgs& args, cudaStream_t stream);

/// Calls a step for the number of words that there is room for: step(words), a constant.
template <typename Step>
cudaError_t with_words(const ProbeArgs& args, const Step& step) {
  if (args.probe_count == 0) return cudaSuccess;
  return args.capacity.words <= kFewWords ? step(std::integral_constant<int, static_cast<int>(kFewWords)>())
                                          : step(std::integral_constant<int, tandem::detail::kMaxWords>());
}

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
__device__ inline void add_up(Counter& sum, Counter part) {
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
