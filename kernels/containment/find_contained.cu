#include "kernels/containment/containment_data.h"
#include "kernels/containment/containment_rule.h"

// These kernels find bodies within bodies. A warp looks at 32 pairs, one a lane; those that may have
// something to report, which are few, it goes through with all its lanes. The kernels are compiled without
// fused operations: posed points are those of the CPU.
namespace tandem::gpu {
namespace {

using containment::PosedSurface;

constexpr std::uint32_t kThreads = 128, kWarps = kThreads / 32;

// A warp looks at so many blocks at a time, four lanes a block.
constexpr std::uint32_t kBlocksAtOnce = 32 / kNodesPerBlock;

/// The blocks that wait. They lie in ascending order of depth: the last kBlocksAtOnce at most are taken, all
/// at least as deep as the rest, and their children put there in the same order. So when blocks of a depth
/// are put there, none of that depth or deeper was left, and there are never more of them than the children
/// of those taken at once: 32 of each depth from 2 to kMaxDepth.
constexpr std::uint32_t kStackSize = 32 * (kMaxDepth - 1);
static_assert(kStackSize * 4 * kWarps <= 48 * 1024);

/// Returns whether the ray from p crosses the closed components an odd number of times. A warp calls it.
template <typename AnyBlock>
__device__ bool is_inside(const PosedSurface& body, const AnyBlock* blocks, const double* p,
                          std::uint32_t* stack) {
  const int node = static_cast<int>(lane_id() % kNodesPerBlock);
  const std::uint32_t slot = lane_id() / kNodesPerBlock;
  std::uint32_t waiting = 1, crossings = 0;
  if (lane_id() == 0) stack[0] = 0;
  while (waiting > 0) {
    __syncwarp();
    const std::uint32_t count = waiting < kBlocksAtOnce ? waiting : kBlocksAtOnce;
    waiting -= count;
    bool internal = false, crosses = false;
    std::uint32_t child = 0;
    if (slot < count) {
      const AnyBlock& block = blocks[stack[waiting + slot]];
      if (ray_may_cross(body, block, node, p)) {
        child = containment::below(block, node);
        internal = !block.is_leaf_block();
        crosses = !internal && ray_crosses(body, child, p);
      }
    }
    crossings += __popc(__ballot_sync(kAllLanes, crosses));
    const std::uint32_t put = __ballot_sync(kAllLanes, internal);
    __syncwarp();  // all have read what is overwritten
    if (internal) stack[waiting + __popc(put & lanes_below())] = child;
    waiting += __popc(put);
  }
  __syncwarp();
  return crossings % 2 != 0;
}

/// Returns whether a contact among those from `first` to `end` is of a component. A warp calls it.
__device__ bool touches(const ContainmentArgs& args, std::uint32_t first, std::uint32_t end,
                        std::uint32_t inner, const std::uint32_t* labels, std::uint32_t component) {
  for (std::uint32_t i = first; i < end; i += 32) {
    bool of_it = false;
    if (i + lane_id() < end) {
      const Contact& contact = args.groups.contacts[i + lane_id()];
      const std::uint32_t t = inner == 0 ? contact.triangle_a : contact.triangle_b;
      of_it = (labels[t] & ~containment::kOfOpenComponent) == component;
    }
    if (__any_sync(kAllLanes, of_it)) return true;
  }
  return false;
}

__device__ PosedSurface posed(const ContainmentArgs& args, std::uint32_t instance) {
  const containment::Surface& surface = args.surfaces[args.instances.asset[instance]];
  return {&surface, for_stored_coordinates(args.instances.pose[instance], surface.origin)};
}

/// Returns whether one of the bodies may have something to report. A thread calls it.
__device__ bool is_worth_a_look(const ContainmentArgs& args, std::uint32_t index) {
  const ObjectPair pair = args.pairs.pairs[index];
  if (pair.a == pair.b) return false;
  const bool has_contacts = args.groups.first_contact[index] != args.groups.first_contact[index + 1];
  const PosedSurface a = posed(args, pair.a), b = posed(args, pair.b);
  return may_have_contained(a, b, has_contacts) || may_have_contained(b, a, has_contacts);
}

/// Result: how many rows the pair has. A warp calls it.
__device__ std::uint32_t find_in_pair(const ContainmentArgs& args, std::uint32_t index,
                                      std::uint32_t* stack) {
  const ObjectPair pair = args.pairs.pairs[index];
  const std::uint32_t first = args.groups.first_contact[index], end = args.groups.first_contact[index + 1];
  std::uint32_t rows = 0;
  for (std::uint32_t inner = 0; inner < 2; ++inner) {
    const PosedSurface body = posed(args, inner == 0 ? pair.a : pair.b),
                       around = posed(args, inner == 0 ? pair.b : pair.a);
    const containment::Surface& surface = *around.surface;
    containment::find_contained(
        body, around, first != end,
        [&](const double* p) {
          return surface.blocks != nullptr ? is_inside(around, surface.blocks, p, stack)
                                           : is_inside(around, surface.oriented_blocks, p, stack);
        },
        [&](std::uint32_t component) {
          return touches(args, first, end, inner, body.surface->labels, component);
        },
        [&](std::uint32_t component, std::uint32_t flags) {
          if (lane_id() == 0) {
            const Counter place = atomicAdd(&args.state->found, Counter{1});
            if (place < args.capacity.contained) args.found[place] = {{index, inner, component, flags}, rows};
          }
          ++rows;
        });
  }
  return rows;
}

__device__ bool has_query(const ContainmentArgs& args) {
  return args.query->status == Status::kOk && args.query->complete != 0 &&
         *args.pairs.count <= args.capacity.pairs;
}

__global__ void __launch_bounds__(kThreads) find(const __grid_constant__ ContainmentArgs args) {
  __shared__ std::uint32_t stacks[kWarps][kStackSize];
  if (!has_query(args)) return;
  const std::uint32_t pairs = *args.pairs.count;
  for (;;) {
    std::uint32_t first = 0;
    if (lane_id() == 0) first = atomicAdd(&args.state->next_pair, 32u);
    first = __shfl_sync(kAllLanes, first, 0);
    if (first >= pairs) return;
    const std::uint32_t index = first + lane_id();
    std::uint32_t rows = 0;
    std::uint32_t left = __ballot_sync(kAllLanes, index < pairs && is_worth_a_look(args, index));
    for (; left != 0; left &= left - 1) {
      const std::uint32_t lane = __ffs(static_cast<int>(left)) - 1;
      const std::uint32_t found = find_in_pair(args, first + lane, stacks[threadIdx.x / 32]);
      if (lane == lane_id()) rows = found;
    }
    if (index < pairs) args.rows_of_pair[index] = rows;
    if (rows > 0) atomicAdd(&args.sums[index / kPairsPerSum], rows);
  }
}

/// The rows of all pairs before this one. A warp calls it.
__device__ std::uint32_t rows_before(const ContainmentArgs& args, std::uint32_t pair) {
  const std::uint32_t sum = pair / kPairsPerSum;
  std::uint32_t rows = 0;
  for (std::uint32_t i = lane_id(); i < sum; i += 32) rows += args.sums[i];
  for (std::uint32_t i = sum * kPairsPerSum + lane_id(); i < pair; i += 32) rows += args.rows_of_pair[i];
  return __reduce_add_sync(kAllLanes, rows);
}

__global__ void __launch_bounds__(kThreads) place(const __grid_constant__ ContainmentArgs args) {
  const Counter found = args.state->found;
  const bool complete = has_query(args) && found <= args.capacity.contained;
  const std::uint32_t warp = (blockIdx.x * kThreads + threadIdx.x) / 32;
  for (std::uint32_t i = warp; complete && i < found; i += gridDim.x * kWarps) {
    const FoundContainment& one = args.found[i];
    const std::uint32_t before = rows_before(args, one.row.pair);
    if (lane_id() == 0) args.contained[before + one.rank] = one.row;
  }
  if (blockIdx.x != 0 || threadIdx.x != 0) return;
  GpuContainmentReport report = {};
  report.status = args.query->status;
  report.complete = complete ? 1 : 0;
  report.needed = {*args.pairs.count, static_cast<std::uint32_t>(found < kNoIndex ? found : kNoIndex)};
  report.contained = complete ? static_cast<std::uint32_t>(found) : 0;
  args.state->report = report;
  *args.host_report = report;
}

}  // namespace

cudaError_t find_contained(const ContainmentArgs& args, cudaStream_t stream) {
  const std::size_t sums = (std::size_t{args.capacity.pairs} / kPairsPerSum + 1) * sizeof(std::uint32_t);
  cudaError_t error = cudaMemsetAsync(args.state, 0, sizeof(ContainmentState), stream);
  if (error == cudaSuccess) error = cudaMemsetAsync(args.sums, 0, sums, stream);
  if (error != cudaSuccess) return error;
  find<<<args.limits.processors * 4, kThreads, 0, stream>>>(args);
  place<<<args.limits.processors * 2, kThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
