#pragma once
#include "kernels/points_and_rays/point_answer.cuh"
#include "kernels/points_and_rays/ray_answer.cuh"

// The answers about the probes that float64 left, anew, by whole numbers, and the order of all hits of a ray.
// Each number of words is a file of its own, since they take minutes to compile.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kExactThreads = 64, kExactBlocksPerProcessor = 8;

/// Decides by whole numbers of so many words; where more are needed, that is noted, and the query is not
/// complete. The code takes KBs of stack and stands once in a kernel.
template <int kWords>
struct Exactly {
  static constexpr bool kExact = true;
  std::uint32_t& words;

  __device__ __noinline__ bool distance(const TrianglePair& pair, const DistanceTolerance& tolerance,
                                        TriangleDistance& out) const {
    if (point_distance_by_float64(pair, tolerance, out)) return true;
    if (!find_distance<kWords>(pair, tolerance, out))
      atomicMax(&words, static_cast<std::uint32_t>(exact::exponents_of(pair).words()));
    return true;
  }

  __device__ bool has_words(const WorldRay& ray, const double (&a)[3][3], const double (&b)[3][3]) const {
    const int needed = tandem::ray::words_of(ray.origin, ray.direction, a, b);
    if (needed > kWords) atomicMax(&words, static_cast<std::uint32_t>(needed));
    return needed <= kWords;
  }

  __device__ __noinline__ tandem::ray::Answer meets(const WorldRay& ray, const double (&corner)[3][3],
                                                    tandem::ray::Meeting& out) const {
    if (!has_words(ray, corner, corner)) return tandem::ray::Answer::no;
    const bool met = tandem::ray::find_meeting<kWords>(ray.origin, ray.direction, corner, out) &&
                     tandem::ray::is_within<kWords>(ray.origin, ray.direction, corner, out, ray.reach);
    return met ? tandem::ray::Answer::yes : tandem::ray::Answer::no;
  }

  __device__ __noinline__ tandem::ray::Answer comes_before(const WorldRay& ray,
                                                           const tandem::ray::FoundHit& x,
                                                           const ProbedBody& body_x,
                                                           const tandem::ray::FoundHit& y,
                                                           const ProbedBody& body_y) const {
    const tandem::ray::Answer answer = tandem::ray::comes_before_by_float64(x, y);
    if (answer != tandem::ray::Answer::unsure) return answer;
    double of_x[3][3], of_y[3][3];
    corners_of(body_x, x.triangle, of_x);
    corners_of(body_y, y.triangle, of_y);
    const bool is_first = has_words(ray, of_x, of_y) && tandem::ray::comes_before_exactly<kWords>(
                                                            ray.origin, ray.direction, x, of_x, y, of_y);
    return is_first ? tandem::ray::Answer::yes : tandem::ray::Answer::no;
  }
};

template <int kWords, typename Options>
__global__ void __launch_bounds__(kExactThreads)
    answer_hard(const __grid_constant__ AskedArgs<Options> args) {
  if (args.counts->error != 0) return;
  const std::uint64_t count = args.counts->hard, step = std::uint64_t{gridDim.x} * kExactThreads;
  const Exactly<kWords> decide = {args.counts->words};
  auto search = search_for(args);
  for (std::uint64_t i = blockIdx.x * kExactThreads + threadIdx.x; i < count; i += step)
    answer(args, args.hard[i], decide, search);
  add_counts(args, search);
}

/// The hits of a ray as a heap whose first is the last of all.
template <int kWords>
struct HitHeap {
  const RayArgs& args;
  const Exactly<kWords>& decide;
  const WorldRay& ray;
  ListedHit* hits;

  __device__ bool comes_before(const ListedHit& x, const ListedHit& y) const {
    return decide.comes_before(ray, x.hit, args.bodies[x.hit.body], y.hit, args.bodies[y.hit.body]) ==
           tandem::ray::Answer::yes;
  }

  /// Moves the hit at a place down to where it belongs, among the first `count`.
  __device__ void sift(std::uint32_t at, std::uint32_t count) const {
    const ListedHit moved = hits[at];
    for (std::uint64_t below = std::uint64_t{2} * at + 1; below < count; below = std::uint64_t{2} * at + 1) {
      auto child = static_cast<std::uint32_t>(below);
      if (child + 1 < count && comes_before(hits[child], hits[child + 1])) ++child;
      if (!comes_before(moved, hits[child])) break;
      hits[at] = hits[child];
      at = child;
    }
    hits[at] = moved;
  }

  __device__ void sort(std::uint32_t count) const {
    for (std::uint32_t i = count / 2; i-- > 0;) sift(i, count);
    for (std::uint32_t last = count - 1; last > 0; --last) {
      const ListedHit hit = hits[last];
      hits[last] = hits[0];
      hits[0] = hit;
      sift(0, last);
    }
  }
};

template <int kWords>
__global__ void __launch_bounds__(kExactThreads) sort(const __grid_constant__ RayArgs args) {
  if (!has_room(args)) return;
  const Exactly<kWords> decide = {args.counts->words};
  const std::uint64_t step = std::uint64_t{gridDim.x} * kExactThreads;
  for (std::uint64_t i = blockIdx.x * kExactThreads + threadIdx.x; i < args.probe_count; i += step) {
    const std::uint32_t first = args.first_hit[i], count = args.first_hit[i + 1] - first;
    if (count == 0) continue;
    const WorldRay ray =
        world_ray(args.asked.origins + 3 * i, args.asked.directions + 3 * i, args.asked.reach);
    if (count > 1) HitHeap<kWords>{args, decide, ray, args.ordered + first}.sort(count);
    for (std::uint32_t j = first; j < first + count; ++j) {
      const tandem::ray::FoundHit& hit = args.ordered[j].hit;
      const std::uint32_t face = args.bodies[hit.body].triangles[hit.triangle].source_face();
      args.rows[j] = row_of(static_cast<std::uint32_t>(i), hit, face);
    }
  }
}

/// Launches a kernel whose threads take one probe after another.
template <typename Args>
cudaError_t launch_exact(void (*kernel)(Args), const Args& args, cudaStream_t stream) {
  kernel<<<args.limits.processors * kExactBlocksPerProcessor, kExactThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

}  // namespace

template <int kWords, typename Options>
cudaError_t answer_by_words(const AskedArgs<Options>& args, cudaStream_t stream) {
  return launch_exact(answer_hard<kWords, Options>, args, stream);
}

template <int kWords>
cudaError_t sort_hits_by_words(const RayArgs& args, cudaStream_t stream) {
  return launch_exact(sort<kWords>, args, stream);
}

}  // namespace tandem::gpu
