#include <type_traits>

#include "kernels/common/pair_record.h"
#include "kernels/refit/refit_data.h"

// These kernels refit trees. They are compiled without fused operations: boxes have the bytes of
// DeformedTree. A thread block refits a cluster of blocks in shared memory. 16 lanes refit a block: lane 4 k
// + i has axis k of node i, and the last four lanes repeat axis 2.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 256, kLanesPerBlock = 16, kBlocksAtOnce = kThreads / kLanesPerBlock;

template <typename Real>
__device__ Real lesser(Real x, Real y) {
  return y < x ? y : x;
}
template <typename Real>
__device__ Real larger(Real x, Real y) {
  return x < y ? y : x;
}

/// The next float32 number that is not above x, and not below it.
__device__ float rounded_down(float x) {
  return x;
}
__device__ float rounded_up(float x) {
  return x;
}
__device__ float rounded_down(double x) {
  return __double2float_rd(x);
}
__device__ float rounded_up(double x) {
  return __double2float_ru(x);
}

/// The positions in float32 or float64 that a body is given, or null. Those in float32 come first.
template <typename Real>
__device__ const Real* positions_of(const DeformArgs& args, std::uint32_t body) {
  const float* const in_float32 =
      args.positions.in_float32 != nullptr ? args.positions.in_float32[body] : nullptr;
  if constexpr (std::is_same_v<Real, float>) {
    return in_float32;
  } else {
    const bool looks_at_them = in_float32 == nullptr && args.positions.in_float64 != nullptr;
    return looks_at_them ? args.positions.in_float64[body] : nullptr;
  }
}

__device__ bool has_positions(const DeformArgs& args, std::uint32_t body) {
  return positions_of<float>(args, body) != nullptr || positions_of<double>(args, body) != nullptr;
}

/// The centre and half-extent of a box along an axis.
struct Interval {
  float centre, half_extent;
};

/// enclose() along an axis; so is box_around() with what it calls.
__device__ float midpoint(float lower, float upper) {
  return 0.5f * lower + 0.5f * upper;
}
__device__ Interval enclose(float lower, float upper) {
  const float centre = midpoint(lower, upper);
  return {centre, larger(half_extent_around(centre, lower, 0), half_extent_around(centre, upper, 0))};
}

/// The lanes that refit one block.
struct BlockLanes {
  std::uint32_t lane = threadIdx.x % kLanesPerBlock, node = lane % kNodesPerBlock,
                column = lane / kNodesPerBlock, axis = column < 3 ? column : 2;
  std::uint32_t all = 0xFFFFu << (threadIdx.x % 32 / kLanesPerBlock * kLanesPerBlock);

  /// Joins what the lanes of the four nodes have.
  template <typename Value, typename Join>
  __device__ Value joined(Value value, const Join& join) const {
    value = join(value, __shfl_xor_sync(all, value, 1, kLanesPerBlock));
    return join(value, __shfl_xor_sync(all, value, 2, kLanesPerBlock));
  }
  __device__ float from(float value, std::uint32_t of_axis) const {
    return __shfl_sync(all, value, static_cast<int>(of_axis * kNodesPerBlock + node), kLanesPerBlock);
  }

  /// oriented_size() of a block whose half-extents the lanes have.
  __device__ float size_of(float half_extent) const {
    const double x = from(half_extent, 0), y = from(half_extent, 1), z = from(half_extent, 2);
    const double surface = (x * y + y * z) + z * x;
    const double largest = joined(x >= 0 ? surface : 0, [](double a, double b) { return a < b ? b : a; });
    return static_cast<float>(sqrt(largest / 3));
  }

  /// The box around a block's nodes. An imaginary one has the interval [inf, -inf].
  __device__ Interval box_around(const Interval& own, bool is_real) const {
    const float lower = joined(own.centre - own.half_extent, lesser<float>),
                upper = joined(own.centre + own.half_extent, larger<float>), centre = midpoint(lower, upper),
                half_extent = is_real ? half_extent_around(centre, own.centre, own.half_extent) : 0;
    return {centre, joined(half_extent, larger<float>)};
  }
};

/// Shared memory of a thread block that refits a cluster. Input: what the cluster begins with: triangles, by
/// the type of their positions, or Box.
template <typename Input>
struct ClusterMemory {
  static constexpr bool kFromTriangles = !std::is_same_v<Input, Box>;
  static constexpr std::uint32_t kBoxes =
      kFromTriangles ? kMostClusterBlocks : kMostInputs + kMostClusterBlocks;
  using Real = std::conditional_t<kFromTriangles, Input, float>;
  RefitBlock block[kMostClusterBlocks];
  std::uint16_t height_end[kMaxDepth];
  Real corner[kFromTriangles ? kMostInputs : 1][3][3];  ///< of the triangles
  float centre[kBoxes][3], half_extent[kBoxes][3];      ///< of boxes around inputs, and then around blocks
};

/// A lane moves so many corners at once, so that it waits for memory once for all of them.
constexpr std::uint32_t kCornersAtOnce = 4;

/// Moves the corners of the cluster's triangles: a lane has a corner at a time.
template <typename Real>
__device__ void move_corners(const DeformingBody& body, const RefitCluster& cluster, const Real* positions,
                             ClusterMemory<Real>& memory) {
  const CornerSource* const sources = body.corners + std::size_t{3} * cluster.first_input;
  uint4* const to = reinterpret_cast<uint4*>(body.triangles + cluster.first_input);
  Real* const corners = &memory.corner[0][0][0];
  const std::uint32_t count = 3 * cluster.inputs;
  for (std::uint32_t first = threadIdx.x; first < count; first += kCornersAtOnce * kThreads) {
    CornerSource source[kCornersAtOnce] = {};
    Real p[kCornersAtOnce][3];
#pragma unroll
    for (std::uint32_t j = 0; j < kCornersAtOnce; ++j) {
      if (first + j * kThreads < count) source[j] = sources[first + j * kThreads];
    }
#pragma unroll
    for (std::uint32_t j = 0; j < kCornersAtOnce; ++j) {
      const Real* const from = positions + std::size_t{3} * source[j].vertex;
      for (int k = 0; k < 3; ++k) p[j][k] = from[k];
    }
#pragma unroll
    for (std::uint32_t j = 0; j < kCornersAtOnce; ++j) {
      const std::uint32_t i = first + j * kThreads;
      if (i >= count) break;
      for (int k = 0; k < 3; ++k) corners[3 * i + static_cast<std::uint32_t>(k)] = p[j][k];
      float rounded[3];
      for (int k = 0; k < 3; ++k) rounded[k] = static_cast<float>(p[j][k]);
      to[i] = {__float_as_uint(rounded[0]), __float_as_uint(rounded[1]), __float_as_uint(rounded[2]),
               source[j].w};
      if constexpr (std::is_same_v<Real, double>) {
        double* const precise = &body.precise[cluster.first_input].position[0][0];
        for (int k = 0; k < 3; ++k) precise[3 * i + static_cast<std::uint32_t>(k)] = p[j][k];
      }
    }
  }
}

template <typename Input>
__device__ void take_blocks(const DeformArgs& args, const RefitCluster& cluster,
                            ClusterMemory<Input>& memory) {
  constexpr std::uint32_t kParts = sizeof(RefitBlock) / sizeof(uint4);
  const uint4* const from = reinterpret_cast<const uint4*>(args.blocks + cluster.first_block);
  uint4* const to = reinterpret_cast<uint4*>(memory.block);
  for (std::uint32_t i = threadIdx.x; i < kParts * cluster.blocks; i += kThreads) to[i] = from[i];
  for (std::uint32_t i = threadIdx.x; i < cluster.heights; i += kThreads)
    memory.height_end[i] = args.height_ends[cluster.first_height + i];
}

__device__ void take_inputs(const DeformArgs& args, const DeformingBody& body, const RefitCluster& cluster,
                            ClusterMemory<Box>& memory) {
  for (std::uint32_t i = threadIdx.x; i < cluster.inputs; i += kThreads) {
    const Box& box = body.roots[args.inputs[cluster.first_input + i]];
    for (int k = 0; k < 3; ++k) {
      memory.centre[i][k] = box.centre[k];
      memory.half_extent[i][k] = box.half_extent[k];
    }
  }
}

template <typename Real>
__device__ Interval around_triangle(const Real (&corner)[3][3], std::uint32_t axis) {
  Real lower = corner[0][axis], upper = lower;
  for (int c = 1; c < 3; ++c) {
    lower = lesser(lower, corner[c][axis]);
    upper = larger(upper, corner[c][axis]);
  }
  return enclose(rounded_down(lower), rounded_up(upper));
}

/// Stores a lane's share of a refitted block.
__device__ void store(const DeformingBody& body, const RefitBlock& block, const BlockLanes& lanes,
                      const Interval& own, const Interval& around, float size) {
  if (lanes.column < 3) {
    if (body.blocks != nullptr) {
      body.blocks[block.block].centre[lanes.axis][lanes.node] = own.centre;
      body.blocks[block.block].half_extent[lanes.axis][lanes.node] = own.half_extent;
    }
    if (body.oriented != nullptr) {
      body.oriented[block.oriented].centre[lanes.axis][lanes.node] = own.centre;
      body.oriented[block.oriented].half_extent[lanes.axis][lanes.node] = own.half_extent;
    }
    if (block.root != kNoIndex && lanes.node == 0) {
      body.roots[block.root].centre[lanes.axis] = around.centre;
      body.roots[block.root].half_extent[lanes.axis] = around.half_extent;
    }
  } else if (body.oriented != nullptr && lanes.node == 0) {
    static_assert(offsetof(OrientedBlock, first_below) % sizeof(uint4) == 0);
    *reinterpret_cast<uint4*>(&body.oriented[block.oriented].first_below) = {
        block.first_below, __float_as_uint(size), kNoRotation.wx, kNoRotation.yz};
  }
}

template <typename Input>
__device__ void refit_block(const DeformingBody& body, const RefitBlock& block, bool is_leaf_block,
                            std::uint32_t box, ClusterMemory<Input>& memory) {
  const BlockLanes lanes;
  const std::uint32_t below = block.below[lanes.node];
  const bool is_real = below != RefitBlock::kNothing;
  Interval own = {kImaginaryCentre, kImaginaryHalfExtent};
  if (is_real && is_leaf_block) {
    own = around_triangle(memory.corner[below], lanes.axis);
  } else if (is_real) {
    own = {memory.centre[below][lanes.axis], memory.half_extent[below][lanes.axis]};
  }
  __syncwarp(lanes.all);
  const Interval around = lanes.box_around(own, is_real);
  const float size = body.oriented != nullptr ? lanes.size_of(own.half_extent) : 0;
  if (lanes.node == 0 && lanes.column < 3) {
    memory.centre[box][lanes.axis] = around.centre;
    memory.half_extent[box][lanes.axis] = around.half_extent;
  }
  store(body, block, lanes, own, around, size);
}

/// Returns whether all positions of a body are sound, if it is given any. A thread block calls it.
__device__ bool has_sound_positions(const DeformingBody& body, bool is_given_any) {
  bool is_bad = !is_given_any;
  for (std::uint32_t i = threadIdx.x; !is_bad && i < body.check_count; i += blockDim.x)
    is_bad = body.checks[i].first_bad != kNoIndex;
  return __syncthreads_or(is_bad) == 0;
}

/// Refits clusters of bodies: those that begin with triangles, of bodies whose positions are of type Input;
/// or those that begin with boxes, of all bodies.
template <typename Input>
__global__ void __launch_bounds__(kThreads)
    refit_clusters(const __grid_constant__ DeformArgs args, const RefitWork* work) {
  __shared__ ClusterMemory<Input> memory;
  wait_for_kernel_before();
  const RefitWork own = work[blockIdx.x];
  const DeformingBody body = args.bodies[own.body];
  const RefitCluster cluster = args.clusters[own.item];
  if constexpr (memory.kFromTriangles) {
    const Input* const positions = positions_of<Input>(args, own.body);
    take_blocks(args, cluster, memory);
    if (!has_sound_positions(body, positions != nullptr)) return;
    move_corners(body, cluster, positions, memory);
  } else {
    const bool is_given_any = has_positions(args, own.body);
    take_blocks(args, cluster, memory);
    if (!has_sound_positions(body, is_given_any)) return;
    take_inputs(args, body, cluster, memory);
  }
  const std::uint32_t boxes_before = memory.kFromTriangles ? 0 : cluster.inputs;
  std::uint32_t begin = 0;
  for (std::uint32_t height = 0; height < cluster.heights; ++height) {
    __syncthreads();
    const std::uint32_t end = memory.height_end[height];
    for (std::uint32_t i = begin + threadIdx.x / kLanesPerBlock; i < end; i += kBlocksAtOnce) {
      refit_block<Input>(body, memory.block[i], memory.kFromTriangles && height == 0, boxes_before + i,
                         memory);
    }
    begin = end;
  }
}

/// Joins what all lanes of a warp have.
template <typename Value, typename Join>
__device__ Value joined_by_warp(Value value, const Join& join) {
  for (int apart = 16; apart > 0; apart /= 2) value = join(value, __shfl_xor_sync(kAllLanes, value, apart));
  return value;
}

__device__ PositionCheck nothing_checked() {
  PositionCheck check = {};
  for (int k = 0; k < 3; ++k) {
    check.lower[k] = kMaxCoordinate;
    check.upper[k] = -kMaxCoordinate;
  }
  check.first_bad = kNoIndex;
  return check;
}

__device__ PositionCheck joined(const PositionCheck& a, const PositionCheck& b) {
  PositionCheck both = a;
  for (int k = 0; k < 3; ++k) {
    both.lower[k] = lesser(a.lower[k], b.lower[k]);
    both.upper[k] = larger(a.upper[k], b.upper[k]);
    both.rounding[k] = larger(a.rounding[k], b.rounding[k]);
  }
  both.first_bad = a.first_bad < b.first_bad ? a.first_bad : b.first_bad;
  return both;
}

template <typename Real>
__device__ PositionCheck check_vertices(const Real* positions, std::uint64_t begin, std::uint64_t end) {
  PositionCheck own = nothing_checked();
  for (std::uint64_t v = begin + threadIdx.x; v < end; v += kThreads) {
    bool is_sound = true;
    for (int k = 0; k < 3; ++k) {
      const Real x = positions[3 * v + static_cast<std::uint64_t>(k)];
      is_sound = is_sound && fabs(x) <= static_cast<Real>(kMaxCoordinate);  // false for NaN
      own.lower[k] = lesser(own.lower[k], rounded_down(x));
      own.upper[k] = larger(own.upper[k], rounded_up(x));
      if constexpr (std::is_same_v<Real, double>)
        own.rounding[k] = larger(own.rounding[k], fabs(x - static_cast<double>(static_cast<float>(x))));
    }
    if (!is_sound && own.first_bad == kNoIndex) own.first_bad = static_cast<std::uint32_t>(v);
  }
  return own;
}

__global__ void __launch_bounds__(kThreads) check_positions(const __grid_constant__ DeformArgs args) {
  __shared__ PositionCheck of_warp[kThreads / 32];
  wait_for_kernel_before();
  const RefitWork work = args.work[blockIdx.x];
  const DeformingBody& body = args.bodies[work.body];
  if (!has_positions(args, work.body)) return;
  const std::uint64_t each = (body.vertices + body.check_count - 1) / body.check_count,
                      begin = each * work.item,
                      end = begin + each < body.vertices ? begin + each : body.vertices;
  const float* const in_float32 = positions_of<float>(args, work.body);
  PositionCheck own = in_float32 != nullptr
                          ? check_vertices(in_float32, begin, end)
                          : check_vertices(positions_of<double>(args, work.body), begin, end);
  for (int k = 0; k < 3; ++k) {
    own.lower[k] = joined_by_warp(own.lower[k], lesser<float>);
    own.upper[k] = joined_by_warp(own.upper[k], larger<float>);
    own.rounding[k] = joined_by_warp(own.rounding[k], larger<double>);
  }
  own.first_bad = __reduce_min_sync(kAllLanes, own.first_bad);
  if (threadIdx.x % 32 == 0) of_warp[threadIdx.x / 32] = own;
  __syncthreads();
  if (threadIdx.x != 0) return;
  for (std::uint32_t warp = 1; warp < kThreads / 32; ++warp) own = joined(own, of_warp[warp]);
  body.checks[work.item] = own;
}

/// The root block of a refitted tree, as far as extent_of() looks at it.
__device__ Block root_of(const DeformingBody& body) {
  Block root = {};
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < kNodesPerBlock; ++i) {
      root.centre[k][i] = body.blocks != nullptr ? body.blocks->centre[k][i] : body.oriented->centre[k][i];
      root.half_extent[k][i] =
          body.blocks != nullptr ? body.blocks->half_extent[k][i] : body.oriented->half_extent[k][i];
    }
  }
  for (int i = 0; i < kNodesPerBlock; ++i)
    root.kind[i] = root.half_extent[0][i] >= 0 ? NodeKind::internal : NodeKind::imaginary;
  return root;
}

/// The asset has the shape of its refitted tree. Positions that are all float32 numbers are what the
/// triangles hold.
__device__ void write_record(const DeformingBody& body, const PositionCheck& all,
                             const GpuAssetRecords& records) {
  GpuAsset& asset = records.assets[body.asset];
  AssetBounds& bounds = records.bounds[body.asset];
  asset.extent = extent_of(root_of(body));
  widen_for_rounding(all.rounding, asset.extent);
  const bool is_rounded = all.rounding[0] > 0 || all.rounding[1] > 0 || all.rounding[2] > 0;
  asset.tree.precise = is_rounded ? body.precise : nullptr;
  asset.tree.number = 0;
  asset.tree.error_bound = 0;
  for (int k = 0; k < 3; ++k) {
    asset.origin[k] = bounds.origin[k] = 0;
    asset.lower[k] = bounds.lower[k] = all.lower[k];
    asset.upper[k] = bounds.upper[k] = all.upper[k];
  }
}

constexpr std::uint32_t kFinishThreads = 1024;
constexpr Counter kNoneIsBad = ~Counter{0};

/// A lane has a body. The first body whose positions are bad is reported. No kernel behind this one may be
/// there before it ends: walks load blocks and triangles by __ldg(), so these must not change while a walk is
/// there, not even while it waits. So this kernel neither begins early nor lets the next one do so.
__global__ void __launch_bounds__(kFinishThreads) finish(const __grid_constant__ DeformArgs args) {
  __shared__ Counter first_bad;
  if (threadIdx.x == 0) first_bad = kNoneIsBad;
  __syncthreads();
  for (std::uint32_t i = threadIdx.x; i < args.body_count; i += kFinishThreads) {
    if (!has_positions(args, i)) continue;
    const DeformingBody& body = args.bodies[i];
    PositionCheck all = nothing_checked();
    for (std::uint32_t c = 0; c < body.check_count; ++c) all = joined(all, body.checks[c]);
    if (all.first_bad == kNoIndex) {
      write_record(body, all, args.records);
    } else {
      atomicMin(&first_bad, Counter{i} << 32 | all.first_bad);
    }
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  GpuDeformReport report = {};
  if (first_bad != kNoneIsBad)
    report = {Status::kOutOfRange, static_cast<std::uint32_t>(first_bad >> 32), first_bad & kNoIndex};
  args.state->report = report;
  *args.host_report = report;
}

}  // namespace

cudaError_t refit_bodies(const DeformArgs& args, cudaStream_t stream) {
  const bool early = args.limits.early_launch;
  cudaError_t error = launch_after({args.work_end[0], kThreads, 0, stream, early}, check_positions, args);
  const auto refit_round = [&](std::uint32_t round, auto* kernel) {
    const std::uint32_t begin = args.work_end[round], count = args.work_end[round + 1] - begin;
    if (error == cudaSuccess)
      error = launch_after({count, kThreads, 0, stream, early}, kernel, args, args.work + begin);
  };
  if (args.positions.in_float32 != nullptr) refit_round(0, refit_clusters<float>);
  if (args.positions.in_float64 != nullptr) refit_round(0, refit_clusters<double>);
  for (std::uint32_t round = 1; round < args.rounds; ++round) refit_round(round, refit_clusters<Box>);
  return error == cudaSuccess ? launch_after({1, kFinishThreads, 0, stream, false}, finish, args) : error;
}

}  // namespace tandem::gpu
