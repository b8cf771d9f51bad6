#include "kernels/common/block_pair.h"
#include "kernels/common/traversal.h"
#include "kernels/contact/leaf_planes.h"
#include "kernels/distance/distance_data.h"

// The narrow walk and the walk of a distance query, and float32 bounds of the triangles that they come to.
// Half a warp takes a block pair, a lane each of its node pairs.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128, kBlocksPerProcessor = 5;
constexpr std::uint32_t kLanes = kNodesPerBlock * kNodesPerBlock;
constexpr int kTurns = 4;  // block pairs of half a warp whose children are appended at once

// A round of the narrow walk has this many block pairs for each pair: as many as the GPU takes at once,
// spread over the pairs that are walked. From 32 on the bound is the distance, but for few pairs in a hundred
// (docs/decisions/distances.md).
constexpr std::uint32_t kNarrowRound = 1u << 14, kFewestNarrow = 32, kMostNarrow = 1u << 10;

/// The outcome of a lane's node pair of a block pair.
struct Visit {
  bool has_below, has_triangles;
  BlockPairEntry below;
  float bound;    ///< of `below`
  bool is_least;  ///< of the node pairs that have the same node of a, or of b
  std::uint32_t triangle_a, triangle_b;
};

/// The least of the bounds of lanes whose numbers differ in these bits.
__device__ float least_over(float bound, std::uint32_t low_bit) {
  bound = fminf(bound, __shfl_xor_sync(kAllLanes, bound, low_bit));
  return fminf(bound, __shfl_xor_sync(kAllLanes, bound, low_bit << 1));
}

/// Returns what follows from the hits of a block pair. hit, bound: of the lane's node pair; infinite where it
/// is none. All lanes of the warp take part.
__device__ Visit follow(const BlockPairEntry& entry, const Block& a, const Block& b, bool hit, float bound) {
  const std::uint32_t lane = lane_id() % kLanes, i = lane / kNodesPerBlock, j = lane % kNodesPerBlock;
  const std::uint32_t hits = __ballot_sync(kAllLanes, hit) >> (lane_id() & kLanes) & kAllNodePairs;
  const float of_row = least_over(bound, 1), of_column = least_over(bound, kNodesPerBlock);
  const bool leaves_a = a.is_leaf_block(), leaves_b = b.is_leaf_block();
  Visit out = {};
  out.has_triangles = hit && leaves_a && leaves_b;
  out.is_least = bound <= of_row || bound <= of_column;
  out.triangle_a = a.index[i];
  out.triangle_b = b.index[j];
  if (hits == 0 || (leaves_a && leaves_b)) return out;
  const Descent descent = leaves_a != leaves_b ? descent_beside_leaves(leaves_a)
                                               : descent_by_size(size_of(a), size_of(b), descends_alone(a));
  if (descent == Descent::both) {
    out.has_below = hit;
    out.below = {entry.pair, a.index[i], b.index[j], kAllNodePairs};
    out.bound = bound;
  } else if (descent == Descent::a_alone) {
    const std::uint32_t row = hits >> kNodesPerBlock * i & 0xFu;
    out.has_below = out.is_least = j == 0 && row != 0;
    out.below = {entry.pair, a.index[i], entry.b, row * 0x1111u};
    out.bound = of_row;
  } else {
    const std::uint32_t column = hits >> j & 0x1111u;
    out.has_below = out.is_least = i == 0 && column != 0;
    out.below = {entry.pair, entry.a, b.index[j], column * 0xFu};
    out.bound = of_column;
  }
  return out;
}

/// Returns the same number for the same blocks on every run, and any number for others.
__device__ std::uint32_t mixed(std::uint32_t a, std::uint32_t b) {
  std::uint32_t x = a * 0x9E3779B1u ^ b * 0x85EBCA77u;
  x = (x ^ x >> 15) * 0x2C1B3C6Du;
  return x ^ x >> 12;
}

/// A round of one of the two walks.
template <bool kNarrow>
class Round {
 public:
  __device__ Round(const DistanceArgs& args, std::uint32_t number)
      : args_(args), number_(number), from_(frontier().round(number)), to_(frontier().round(number + 1)) {}

  __device__ void run() {
    count_ = stored_in(from_);
    if (kNarrow) {
      const Counter pairs = *args_.walked.count;
      width_ = min(max(kNarrowRound / static_cast<std::uint32_t>(max(pairs, Counter{1})), kFewestNarrow),
                   kMostNarrow);
      clear_round_after_next();
    }
    share_out<kLanes>(count_, kTurns, [&](std::uint32_t first, std::uint32_t turns) { visit(first, turns); });
  }

 private:
  __device__ const Frontier<BlockPairEntry>& frontier() const {
    return kNarrow ? args_.narrow : args_.frontier;
  }
  __device__ const AppendList<TrianglePairEntry>& triangles() const {
    return kNarrow ? args_.seeds : args_.near;
  }

  __device__ void clear_round_after_next() const {
    const std::uint32_t pairs = stored_in(args_.walked), buffer = (number_ + 2) % 3;
    const std::uint64_t step = gridDim.x * kThreads;
    for (std::uint64_t i = blockIdx.x * kThreads + threadIdx.x; i < pairs * std::uint64_t{kSteps};
         i += step) {
      Narrowing& narrowing = args_.narrowings[args_.walked.entries[i / kSteps]];
      narrowing.steps[buffer][i % kSteps] = 0;
      if (i % kSteps == 0) narrowing.least[buffer] = 0;
    }
  }

  __device__ void visit(std::uint32_t first, std::uint32_t turns) {
    AppendBatch<BlockPairEntry, kTurns> below;
    AppendBatch<TrianglePairEntry, kTurns> triangles;
    std::uint32_t visited = 0;
#pragma unroll
    for (int turn = 0; turn < kTurns; ++turn) {
      if (static_cast<std::uint32_t>(turn) >= turns) break;
      const std::uint32_t index = first + 32 / kLanes * turn;
      BlockPairEntry entry = from_.entries[index < count_ ? index : count_ - 1];
      const bool wanted = is_wanted(entry) && index < count_;
      if (!wanted) entry.mask = 0;
      visited += wanted;
      if (__ballot_sync(kAllLanes, wanted) == 0) continue;
      take(entry, turn, below, triangles);
    }
    below.append_to(to_);
    triangles.append_to(this->triangles());
    if (kNarrow) {
      visited += __shfl_xor_sync(kAllLanes, visited, kLanes);
      if (lane_id() == 0 && visited != 0)
        atomicAdd(&args_.state->narrow_block_pairs, static_cast<Counter>(visited));
    }
  }

  /// Returns whether an entry is among the `width_` of its pair that have the least bounds. In the step where
  /// the room ends, a part of the entries is taken: any part, but the same on every run.
  __device__ bool is_wanted(const BlockPairEntry& entry) const {
    if (!kNarrow) return true;
    const std::uint32_t(&steps)[kSteps] = args_.narrowings[entry.pair].steps[number_ % 3];
    const std::uint32_t step = entry.mask >> 16, lane = lane_id() % kLanes;
    std::uint32_t before = 0;
    for (std::uint32_t i = lane; i < kSteps; i += kLanes) before += i < step ? steps[i] : 0;
    for (std::uint32_t bit = 1; bit < kLanes; bit <<= 1) before += __shfl_xor_sync(kAllLanes, before, bit);
    if (before >= width_) return false;
    const std::uint64_t here = steps[step], room = width_ - before;
    return mixed(entry.a, entry.b) * here < room << 32;
  }

  /// Visits a block pair, with mask 0 none.
  __device__ void take(const BlockPairEntry& entry, int turn, AppendBatch<BlockPairEntry, kTurns>& below,
                       AppendBatch<TrianglePairEntry, kTurns>& triangles) const {
    const DistanceRecord& record = args_.records[entry.pair];
    NearState& state = args_.near_states[entry.pair];
    const Block &a = record.pair.blocks_a[entry.a], &b = record.pair.blocks_b[entry.b];
    const std::uint32_t lane = lane_id() % kLanes;
    const int i = static_cast<int>(lane) / kNodesPerBlock, j = static_cast<int>(lane) % kNodesPerBlock;
    bool hit = false;
    float bound = INFINITY;
    if ((entry.mask >> lane & 1) != 0) {
      if (record.pair.in_frame != 0)
        hit = is_near_in_frame(record, state, a, i, b, j, bound);
      else
        hit = is_near_in_world(record, state, a, i, b, j, bound);
    }
    const Visit found = follow(entry, a, b, hit, hit ? bound : INFINITY);
    // The narrow walk takes the nearest of each node: nearly half fewer, and to the same triangles mostly.
    if (found.has_below && (!kNarrow || found.is_least)) {
      BlockPairEntry next = found.below;
      if (kNarrow) next.mask |= count_in(args_.narrowings[entry.pair], state.top, found.bound) << 16;
      below.put(turn, next);
    }
    if (found.has_triangles && (kNarrow ? found.is_least : !is_far(record, state, found)))
      triangles.put(turn, {entry.pair, found.triangle_a, found.triangle_b});
  }

  __device__ static bool is_near_in_frame(const DistanceRecord& record, NearState& state, const Block& a,
                                          int i, const Block& b, int j, float& bound) {
    bound = box_distance_bound(box_of(a, i), box_of(b, j), pose_of(record.pair));
    if (!kNarrow && !(bound < state.limit) && bound < state.open_limit)
      lessen(state.floor, distance::distance_of(frame_of(record), bound));
    return bound < state.limit;
  }

  __device__ bool is_near_in_world(const DistanceRecord& record, NearState& state, const Block& a, int i,
                                   const Block& b, int j, float& bound) const {
    if (a.kind[i] == NodeKind::imaginary || b.kind[j] == NodeKind::imaginary) return false;
    const double gap = distance_between(node_world_box(stored_pose(args_, record.pair.instance_a), a, i),
                                        node_world_box(stored_pose(args_, record.pair.instance_b), b, j));
    if (!kNarrow && !(gap < state.near) && gap < state.open_near) lessen(state.floor, gap);
    bound = __double2float_rd(gap);
    return gap < state.near;
  }

  /// Counts a bound of the next round. Result: its step.
  __device__ std::uint32_t count_in(Narrowing& narrowing, float top, float bound) const {
    const std::uint32_t next = (number_ + 1) % 3;
    const float least = __uint_as_float(~narrowing.least[number_ % 3]), above = bound - least;
    int step = 0;
    if (above > 0) step = max(((__float_as_int(above) - __float_as_int(top)) >> 23) + kSteps - 1, 0);
    step = min(step, kSteps - 1);
    atomicAdd(&narrowing.steps[next][step], 1u);
    const std::uint32_t complement = ~__float_as_uint(bound);
    if (complement > *static_cast<volatile std::uint32_t*>(&narrowing.least[next]))
      atomicMax(&narrowing.least[next], complement);
    return static_cast<std::uint32_t>(step);
  }

  /// Returns whether the direction of the nearest triangles so far tells that these are no nearer.
  __device__ static bool is_far(const DistanceRecord& record, const NearState& state, const Visit& found) {
    if (record.pair.in_frame == 0) return false;
    return distance::is_far_along(
        stored_triangle(record.pair.triangles_a[found.triangle_a]).corner,
        posed_triangle(pose_of(record.pair), record.pair.triangles_b[found.triangle_b]).corner, state.along);
  }

  const DistanceArgs& args_;
  const std::uint32_t number_;
  const AppendList<BlockPairEntry> from_, to_;
  std::uint32_t count_ = 0, width_ = 0;
};

template <bool kNarrow>
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    walk_round(const __grid_constant__ DistanceArgs args, std::uint32_t number) {
  wait_for_kernel_before();
  Round<kNarrow>(args, number).run();
}

template <bool kSeeds>
__device__ const AppendList<TrianglePairEntry>& list_of(const DistanceArgs& args) {
  return kSeeds ? args.seeds : args.near;
}

__device__ distance::FrameInterval<float> frame_interval_of(const DistanceRecord& record, std::uint32_t a,
                                                            std::uint32_t b, bool& touches) {
  const TriangleInFrame of_a = stored_triangle(record.pair.triangles_a[a]),
                        of_b = posed_triangle(pose_of(record.pair), record.pair.triangles_b[b]);
  const auto interval = distance::frame_interval(of_a.corner, of_b.corner, record.pair.frame_error);
  touches =
      interval.lower == 0 && frame::decide<true>(of_a.corner, of_b.corner, record.pair.frame_error).contact;
  return interval;
}

/// An upper bound of the distance in the world of triangles with these bounds. What float32 cannot take is
/// bounded only where a bound is needed.
template <bool kSeeds>
__device__ double upper_of(const DistanceArgs& args, const TrianglePairEntry& entry,
                           const FrameBounds& bounds) {
  const DistanceRecord& record = args.records[entry.pair];
  if (record.pair.in_frame != 0) return static_cast<double>(bounds.upper) * record.most_in_world;
  if (!kSeeds) return INFINITY;
  return settle<kFewWords>(args, posed_pair(args, entry.pair, entry.a, entry.b)).interval.upper;
}

/// Bounds triangles by float32, and their pairs' distances.
template <bool kSeeds>
__global__ void __launch_bounds__(kThreads) bound_triangles(const __grid_constant__ DistanceArgs args) {
  wait_for_kernel_before();
  const auto& list = list_of<kSeeds>(args);
  const std::uint32_t count = stored_in(list);
  for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < count; i += gridDim.x * kThreads) {
    const TrianglePairEntry entry = list.entries[i];
    const DistanceRecord& record = args.records[entry.pair];
    FrameBounds bounds = {0, INFINITY};
    if (record.pair.in_frame != 0) {
      bool touches;
      const auto interval = frame_interval_of(record, entry.a, entry.b, touches);
      bounds = {interval.lower, touches ? 0 : interval.upper};
    }
    args.bounds[i] = bounds;
    lessen(args.near_states[entry.pair].upper, upper_of<kSeeds>(args, entry, bounds));
  }
}

/// Names the triangles that told the upper bound; of several the first.
template <bool kSeeds>
__global__ void __launch_bounds__(kThreads) choose_nearest(const __grid_constant__ DistanceArgs args) {
  wait_for_kernel_before();
  const auto& list = list_of<kSeeds>(args);
  const std::uint32_t count = stored_in(list);
  for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < count; i += gridDim.x * kThreads) {
    const TrianglePairEntry entry = list.entries[i];
    NearState& state = args.near_states[entry.pair];
    if (upper_of<kSeeds>(args, entry, args.bounds[i]) == as_double(state.upper))
      atomicMin(kSeeds ? &state.seed : &state.first, triangles_as_number(entry.a, entry.b));
  }
}

/// Writes what the walk has to know of the triangles that the narrow walk found. Result: whether there is
/// anything left to be found.
__device__ bool aim_at_nearest(const DistanceArgs& args, std::uint32_t pair) {
  const DistanceRecord& record = args.records[pair];
  NearState& state = args.near_states[pair];
  const double beyond = beyond_reach(args, pair), upper = upper_in(state, beyond);
  state.near = nearness(args, upper, beyond);
  state.open_near = upper;
  if (record.pair.in_frame != 0) {
    const DistanceFrame frame = frame_of(record);
    state.limit = distance::limit_of(frame, state.near);
    state.open_limit = distance::limit_of(frame, upper);
    float along[3] = {};
    if (state.seed != kNoTriangles) {
      bool touches;
      const auto interval = frame_interval_of(record, static_cast<std::uint32_t>(state.seed >> 32),
                                              static_cast<std::uint32_t>(state.seed), touches);
      for (int k = 0; k < 3; ++k) along[k] = interval.along.x[k];
    }
    state.along = distance::frame_direction(frame, along, upper);
  }
  return upper > 0;
}

__global__ void __launch_bounds__(kThreads) aim(const __grid_constant__ DistanceArgs args) {
  wait_for_kernel_before();
  const std::uint32_t count = stored_in(args.walked);
  for (std::uint32_t begin = blockIdx.x * kThreads + threadIdx.x - lane_id(); begin < count;
       begin += gridDim.x * kThreads) {
    AppendBatch<BlockPairEntry, 1> roots;
    if (begin + lane_id() < count) {
      const std::uint32_t pair = args.walked.entries[begin + lane_id()];
      if (aim_at_nearest(args, pair)) roots.put(0, {pair, 0, 0, kAllNodePairs});
    }
    roots.append_to(args.frontier.round(0));
  }
}

template <bool kNarrow>
cudaError_t walk(const Grid& grid, const DistanceArgs& args) {
  cudaError_t error = launch_rounds(grid, walk_round<kNarrow>, args, args.rounds);
  if (error == cudaSuccess) error = launch_after(grid, bound_triangles<kNarrow>, args);
  return error == cudaSuccess ? launch_after(grid, choose_nearest<kNarrow>, args) : error;
}

}  // namespace

cudaError_t walk_distances(const DistanceArgs& args, cudaStream_t stream) {
  const Grid grid = {args.limits.processors * kBlocksPerProcessor, kThreads, 0, stream,
                     args.limits.early_launch};
  cudaError_t error = walk<true>(grid, args);
  if (error == cudaSuccess) error = launch_after(grid, aim, args);
  return error == cudaSuccess ? walk<false>(grid, args) : error;
}

}  // namespace tandem::gpu
