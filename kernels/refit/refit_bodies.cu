#include "kernels/common/pair_record.h"
#include "kernels/refit/refit_data.h"

// These kernels refit trees. They are compiled without fused operations: boxes have the bytes of
// DeformedTree. A thread block refits a cluster of blocks in shared memory. 16 lanes refit a block: lane 4 k
// + i has axis k of node i, and the last four lanes repeat axis 2.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 256, kLanesPerBlock = 16, kBlocksAtOnce = kThreads / kLanesPerBlock;

__device__ float lesser(float x, float y) {
  return y < x ? y : x;
}
__device__ float larger(float x, float y) {
  return x < y ? y : x;
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
    const float lower = joined(own.centre - own.half_extent, lesser),
                upper = joined(own.centre + own.half_extent, larger), centre = midpoint(lower, upper),
                half_extent = is_real ? half_extent_around(centre, own.centre, own.half_extent) : 0;
    return {centre, joined(half_extent, larger)};
  }
};

/// Shared memory of a thread block that refits a cluster.
template <bool kFromTriangles>
struct ClusterMemory {
  static constexpr std::uint32_t kBoxes =
      kFromTriangles ? kMostClusterBlocks : kMostInputs + kMostClusterBlocks;
  RefitBlock block[kMostClusterBlocks];
  std::uint16_t height_end[kMaxDepth];
  float corner[kFromTriangles ? kMostInputs : 1][3][3];  ///< of the triangles
  float centre[kBoxes][3], half_extent[kBoxes][3];       ///< of boxes around inputs, and then around blocks
};

/// A lane moves so many corners at once, so that it waits for memory once for all of them.
constexpr std::uint32_t kCornersAtOnce = 4;

/// Moves the corners of the cluster's triangles: a lane has a corner at a time.
__device__ void move_corners(const DeformingBody& body, const RefitCluster& cluster, const float* positions,
                             ClusterMemory<true>& memory) {
  const CornerSource* const sources = body.corners + std::size_t{3} * cluster.first_input;
  uint4* const to = reinterpret_cast<uint4*>(body.triangles + cluster.first_input);
  float* const corners = &memory.corner[0][0][0];
  const std::uint32_t count = 3 * cluster.inputs;
  for (std::uint32_t first = threadIdx.x; first < count; first += kCornersAtOnce * kThreads) {
    CornerSource source[kCornersAtOnce] = {};
    float p[kCornersAtOnce][3];
#pragma unroll
    for (std::uint32_t j = 0; j < kCornersAtOnce; ++j) {
      if (first + j * kThreads < count) source[j] = sources[first + j * kThreads];
    }
#pragma unroll
    for (std::uint32_t j = 0; j < kCornersAtOnce; ++j) {
      const float* const from = positions + std::size_t{3} * source[j].vertex;
      for (int k = 0; k < 3; ++k) p[j][k] = from[k];
    }
#pragma unroll
    for (std::uint32_t j = 0; j < kCornersAtOnce; ++j) {
      const std::uint32_t i = first + j * kThreads;
      if (i >= count) break;
      for (int k = 0; k < 3; ++k) corners[3 * i + static_cast<std::uint32_t>(k)] = p[j][k];
      to[i] = {__float_as_uint(p[j][0]), __float_as_uint(p[j][1]), __float_as_uint(p[j][2]), source[j].w};
    }
  }
}

template <bool kFromTriangles>
__device__ void take_blocks(const DeformArgs& args, const RefitCluster& cluster,
                            ClusterMemory<kFromTriangles>& memory) {
  constexpr std::uint32_t kParts = sizeof(RefitBlock) / sizeof(uint4);
  const uint4* const from = reinterpret_cast<const uint4*>(args.blocks + cluster.first_block);
  uint4* const to = reinterpret_cast<uint4*>(memory.block);
  for (std::uint32_t i = threadIdx.x; i < kParts * cluster.blocks; i += kThreads) to[i] = from[i];
  for (std::uint32_t i = threadIdx.x; i < cluster.heights; i += kThreads)
    memory.height_end[i] = args.height_ends[cluster.first_height + i];
}

__device__ void take_inputs(const DeformArgs& args, const DeformingBody& body, const RefitCluster& cluster,
                            ClusterMemory<false>& memory) {
  for (std::uint32_t i = threadIdx.x; i < cluster.inputs; i += kThreads) {
    const Box& box = body.roots[args.inputs[cluster.first_input + i]];
    for (int k = 0; k < 3; ++k) {
      memory.centre[i][k] = box.centre[k];
      memory.half_extent[i][k] = box.half_extent[k];
    }
  }
}

__device__ Interval around_triangle(const float (&corner)[3][3], std::uint32_t axis) {
  float lower = corner[0][axis], upper = lower;
  for (int c = 1; c < 3; ++c) {
    lower = lesser(lower, corner[c][axis]);
    upper = larger(upper, corner[c][axis]);
  }
  return enclose(lower, upper);
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

template <bool kFromTriangles>
__device__ void refit_block(const DeformingBody& body, const RefitBlock& block, bool is_leaf_block,
                            std::uint32_t box, ClusterMemory<kFromTriangles>& memory) {
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

/// Returns whether a body has positions and all are sound. A thread block calls it.
__device__ bool has_sound_positions(const DeformingBody& body, const float* positions) {
  bool is_bad = positions == nullptr;
  for (std::uint32_t i = threadIdx.x; !is_bad && i < body.check_count; i += blockDim.x)
    is_bad = body.checks[i].first_bad != kNoIndex;
  return __syncthreads_or(is_bad) == 0;
}

template <bool kFromTriangles>
__global__ void __launch_bounds__(kThreads)
    refit_clusters(const __grid_constant__ DeformArgs args, const RefitWork* work) {
  __shared__ ClusterMemory<kFromTriangles> memory;
  wait_for_kernel_before();
  const RefitWork own = work[blockIdx.x];
  const DeformingBody body = args.bodies[own.body];
  const RefitCluster cluster = args.clusters[own.item];
  const float* const positions = args.positions[own.body];
  take_blocks(args, cluster, memory);
  if (!has_sound_positions(body, positions)) return;
  if constexpr (kFromTriangles) {
    move_corners(body, cluster, positions, memory);
  } else {
    take_inputs(args, body, cluster, memory);
  }
  const std::uint32_t boxes_before = kFromTriangles ? 0 : cluster.inputs;
  std::uint32_t begin = 0;
  for (std::uint32_t height = 0; height < cluster.heights; ++height) {
    __syncthreads();
    const std::uint32_t end = memory.height_end[height];
    for (std::uint32_t i = begin + threadIdx.x / kLanesPerBlock; i < end; i += kBlocksAtOnce) {
      refit_block<kFromTriangles>(body, memory.block[i], kFromTriangles && height == 0, boxes_before + i,
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
  }
  both.first_bad = a.first_bad < b.first_bad ? a.first_bad : b.first_bad;
  return both;
}

__device__ PositionCheck check_vertices(const float* positions, std::uint64_t begin, std::uint64_t end) {
  PositionCheck own = nothing_checked();
  for (std::uint64_t v = begin + threadIdx.x; v < end; v += kThreads) {
    bool is_sound = true;
    for (int k = 0; k < 3; ++k) {
      const float x = positions[3 * v + static_cast<std::uint64_t>(k)];
      is_sound = is_sound && fabsf(x) <= kMaxCoordinate;  // false for NaN
      own.lower[k] = lesser(own.lower[k], x);
      own.upper[k] = larger(own.upper[k], x);
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
  const float* const positions = args.positions[work.body];
  if (positions == nullptr) return;
  const std::uint64_t each = (body.vertices + body.check_count - 1) / body.check_count,
                      begin = each * work.item,
                      end = begin + each < body.vertices ? begin + each : body.vertices;
  PositionCheck own = check_vertices(positions, begin, end);
  for (int k = 0; k < 3; ++k) {
    own.lower[k] = joined_by_warp(own.lower[k], lesser);
    own.upper[k] = joined_by_warp(own.upper[k], larger);
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

/// The asset has the shape of its refitted tree.
__device__ void write_record(const DeformingBody& body, const PositionCheck& all,
                             const GpuAssetRecords& records) {
  GpuAsset& asset = records.assets[body.asset];
  AssetBounds& bounds = records.bounds[body.asset];
  asset.extent = extent_of(root_of(body));
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
    if (args.positions[i] == nullptr) continue;
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
  for (std::uint32_t round = 0; round < args.rounds && error == cudaSuccess; ++round) {
    const std::uint32_t begin = args.work_end[round], count = args.work_end[round + 1] - begin;
    error = launch_after({count, kThreads, 0, stream, early},
                         round == 0 ? refit_clusters<true> : refit_clusters<false>, args, args.work + begin);
  }
  return error == cudaSuccess ? launch_after({1, kFinishThreads, 0, stream, false}, finish, args) : error;
}

}  // namespace tandem::gpu
