#include "kernels/manifold/kept_manifold.h"
#include "kernels/manifold/manifold_data.h"

// These kernels keep the manifolds of pairs that have not moved. They are compiled without fused operations,
// as those that make manifolds.
namespace tandem::gpu {
namespace {

using manifold::FoundManifold;
using manifold::FoundPoint;

constexpr std::uint32_t kThreads = 256;
// So many lanes move a manifold, one point each.
constexpr std::uint32_t kLanes = 8;
static_assert(kMostManifoldPoints <= kLanes);

__device__ std::uint32_t first_thread() {
  return blockIdx.x * kThreads + threadIdx.x;
}
__device__ std::uint32_t thread_count() {
  return gridDim.x * kThreads;
}

template <typename Element>
__device__ void copy(const Element* from, Element* to, std::uint32_t count) {
  static_assert(sizeof(Element) % 8 == 0);
  constexpr std::uint32_t kWords = sizeof(Element) / 8;
  const auto* const words_from = reinterpret_cast<const Counter*>(from);
  auto* const words_to = reinterpret_cast<Counter*>(to);
  for (std::uint64_t i = first_thread(); i < std::uint64_t{count} * kWords; i += thread_count())
    words_to[i] = words_from[i];
}

/// Keeps what the last call found. It runs before remember_points(), which says that there is no last call.
__global__ void __launch_bounds__(kThreads) remember_found(const __grid_constant__ ManifoldArgs args) {
  ManifoldState& state = *args.state;
  if (state.has_last != 0) {
    copy(args.found_manifolds, args.found_manifolds_before, state.last_manifolds);
    copy(args.found_points, args.found_points_before, state.last_points);
    copy(args.places, args.places_before, state.last_pairs);
  }
  if (first_thread() != 0) return;
  if (state.has_last != 0) state.call_before = state.moved_call;
  state.kept_manifolds = state.kept_points = 0;
}

/// Counts what is kept.
__global__ void __launch_bounds__(kThreads) count_kept(const __grid_constant__ ManifoldArgs args) {
  if (!keeps(args)) return;
  Counter manifolds = 0, points = 0, open = 0, ambiguous = 0;
  const std::uint32_t pairs = pair_count(args);
  for (std::uint32_t i = first_thread(); i < pairs; i += thread_count()) {
    const std::uint32_t row = args.moved.kept_rows[i];
    if (row == kNoIndex) continue;
    const PairPlace place = args.places_before[row];
    manifolds += place.manifolds, points += place.points;
    for (std::uint32_t k = 0; k < place.manifolds; ++k) {
      const std::uint32_t flags = args.manifolds_before[place.first_manifold + k].flags;
      open += (flags & kOpenCurve) != 0, ambiguous += (flags & kAmbiguous) != 0;
    }
  }
  const auto add = [](Counter& to, Counter of_thread) {
    for (int by = 16; by > 0; by /= 2) of_thread += __shfl_down_sync(0xFFFFFFFFu, of_thread, by);
    if (threadIdx.x % 32 == 0 && of_thread != 0) atomicAdd(&to, of_thread);
  };
  add(args.state->kept_manifolds, manifolds);
  add(args.state->kept_points, points);
  add(args.state->open_curves, open);
  add(args.state->ambiguous_touches, ambiguous);
}

/// The greatest of the numbers of a group's lanes.
__device__ double greatest_of_group(double number) {
  const std::uint32_t lanes = ((1u << kLanes) - 1) << (threadIdx.x % 32 / kLanes * kLanes);
  for (int by = kLanes / 2; by > 0; by /= 2) {
    const double other = __shfl_xor_sync(lanes, number, by);
    if (other > number) number = other;
  }
  return number;
}

/// Moves the manifolds of a pair: all lanes of a group, a point each.
__device__ void move_pair(const ManifoldArgs& args, std::uint32_t pair, std::uint32_t row,
                          std::uint32_t lane) {
  const PairPlace place = args.places[pair], before = args.places_before[row];
  if (place.manifolds == 0) return;
  const PosedBodies& then = args.moved.posed[pair];
  const AssetBox *a = &args.moved.boxes[then.a.asset], *b = &args.moved.boxes[then.b.asset];
  const manifold::KeptMotion motion({then.a.pose, then.b.pose},
                                    {args.instances.pose[then.pair.a], args.instances.pose[then.pair.b]},
                                    second_is_larger(*a, *b));
  for (std::uint32_t i = 0; i < place.manifolds; ++i) {
    const std::uint32_t to = place.first_manifold + i, from = before.first_manifold + i;
    const FoundManifold of_then = args.found_manifolds_before[from];
    Manifold kept = args.manifolds_before[from];
    motion.move(of_then, kept);
    const std::uint32_t point_from = kept.first_point + lane;
    kept.pair = pair;
    kept.first_point = place.first_point + (kept.first_point - before.first_point);
    double depth = -INFINITY;
    if (lane < kept.point_count) {
      const std::uint32_t point_to = kept.first_point + lane;
      const FoundPoint of_point = args.found_points_before[point_from];
      ManifoldPoint point = args.points_before[point_from];
      motion.move(of_point, point);
      point.previous = args.matches ? point_from : kNoIndex;
      point.manifold = to;
      args.points[point_to] = point;
      args.found_points[point_to] = of_point;
      depth = point.depth;
    }
    depth = greatest_of_group(depth);
    if (kept.point_count > 0) kept.depth = depth;
    if (lane != 0) continue;
    args.manifolds[to] = kept;
    args.found_manifolds[to] = of_then;
    args.entries[to] = {std::uint64_t{then.pair.a} << 32 | then.pair.b, place.first_point,
                        i == 0 ? place.points : 0};
  }
}

__global__ void __launch_bounds__(kThreads) move_kept(const __grid_constant__ ManifoldArgs args) {
  wait_for_kernel_before();
  if (!is_complete(args)) return;
  const std::uint32_t pairs = pair_count(args);
  for (std::uint32_t i = first_thread() / kLanes; i < pairs; i += thread_count() / kLanes) {
    const std::uint32_t row = args.moved.kept_rows[i];
    if (row != kNoIndex) move_pair(args, i, row, threadIdx.x % kLanes);
  }
}

}  // namespace

cudaError_t remember_kept(const ManifoldArgs& args, cudaStream_t stream) {
  if (args.moved.call == nullptr) return cudaSuccess;
  // This runs after whatever kernel of the user's, and so after all of it.
  remember_found<<<args.limits.processors * 2, kThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

cudaError_t count_kept_manifolds(const ManifoldArgs& args, cudaStream_t stream) {
  if (args.moved.call == nullptr) return cudaSuccess;
  count_kept<<<args.limits.processors * 2, kThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

cudaError_t move_kept_manifolds(const ManifoldArgs& args, cudaStream_t stream) {
  if (args.moved.call == nullptr) return cudaSuccess;
  const Grid grid = {args.limits.processors * 4, kThreads, 0, stream, args.limits.early_launch};
  return launch_after(grid, move_kept, args);
}

}  // namespace tandem::gpu
