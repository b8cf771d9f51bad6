#include <algorithm>

#include "kernels/contact/gpu_query_data.h"

// Before the walk, these kernels find what is wrong with instances and pairs, and how the two of a pair lie.
// They are compiled without fused operations, so that poses, and masks that follow from them, are those of
// the CPU.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 32;  // few, so that few pairs spread over all multiprocessors

__device__ void report_error(const QueryArgs& args, Subject subject, Counter where, Status status) {
  atomicMax(&args.state->error, packed_error(subject, where, status));
}

template <bool kNear>
__device__ void prepare_pair(const QueryArgs& args, std::uint32_t index) {
  const ObjectPair pair = args.given.pairs[index];
  if (const Status status = check_pair(pair, args.instances.count); status != Status::kOk)
    return report_error(args, Subject::pair, index, status);
  if (args.instances.asset[pair.a] >= args.asset_count || args.instances.asset[pair.b] >= args.asset_count)
    return;  // reported with the instance
  const std::uint32_t asset = args.instances.asset[pair.a];
  if (args.neighbourhoods != nullptr && pair.a == pair.b && args.assets[asset].tree.topology == nullptr)
    return report_error(args, Subject::topology, asset, Status::kNoTopology);
  distance::FrameClearance clearance;
  const PairRecord record = make_record(args.instances, args.assets, pair, walked_kind(args.mode),
                                        kNear ? clearance_of(args, pair.a, pair.b) : 0, clearance);
  args.pairs[index] = record;
  if (kNear) args.clearances[index] = clearance;
  if (args.first_contact_only) args.met[index] = 0;
  if (record.in_frame == 0) args.world_pairs[atomicAdd(&args.state->world_pairs, 1u)] = index;
}

/// No pair has contacts yet, and no tile of pairs has a sum.
__device__ void clear_groups(const QueryArgs& args, std::uint32_t first, std::uint32_t step,
                             std::uint32_t pairs) {
  const Grouping& grouping = args.grouping;
  for (std::uint32_t i = first; i < pairs; i += step) grouping.next[i * spread_of(pairs)] = 0;
  for (std::uint32_t i = first; i < tiles_of(pairs); i += step) {
    grouping.tile_contacts[i] = grouping.tile_pairs[i] = 0;
  }
  if (first == 0) args.state->tiles_taken = 0;
}

/// kNear: of a query of clearance.
template <bool kNear>
__global__ void __launch_bounds__(kThreads) prepare(const __grid_constant__ QueryArgs args) {
  wait_for_kernel_before();
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  const std::uint32_t pairs = pair_count(args);
  if (args.grouping.first_contact != nullptr) clear_groups(args, first, step, pairs);
  for (std::uint32_t i = first; i < pairs; i += step) prepare_pair<kNear>(args, i);
  for (std::uint32_t i = step - 1 - first; i < args.instances.count;
       i += step) {  // by other threads, at first
    const Status status = check_instance(args.instances, args.assets, args.asset_count, i);
    if (status != Status::kOk) report_error(args, Subject::instance, i, status);
  }
}

}  // namespace

cudaError_t prepare_pairs(const QueryArgs& args, cudaStream_t stream) {
  // No more blocks than there is work for, where the CPU knows: launching many takes a microsecond or two.
  const std::uint64_t most =
      std::uint64_t{args.instances.count} + std::min(args.given.capacity, args.capacity.pairs);
  const auto blocks =
      static_cast<std::uint32_t>(std::min<std::uint64_t>(args.limits.processors * 32, most / kThreads + 1));
  return launch_after({blocks, kThreads, 0, stream, args.limits.early_launch},
                      args.near ? prepare<true> : prepare<false>, args);
}

}  // namespace tandem::gpu
