#include "gpu_query_data.h"
#include "tandem/kernels/detail/frame_test.h"
#include "tandem/kernels/world_box.h"

// Before the walk: what is wrong with instances and pairs, and how the two of a pair lie. Compiled without
// fused operations, so that poses, and masks that follow from them, are those of the CPU.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 32;  // few, so that few pairs spread over all multiprocessors

enum What : Counter { kInstance, kPair };  // the CPU's order of checks

__device__ void report_error(const QueryArgs& args, What what, Counter where, Status status) {
  atomicMax(&args.state->error, ~(what << 40 | where << 8 | static_cast<Counter>(status)));
}

__device__ Status check_instance(const QueryArgs& args, std::uint32_t instance) {
  if (args.instances.asset[instance] >= args.asset_count) return Status::kUnknownAsset;
  if (!is_rigid(args.instances.pose[instance])) return Status::kPoseNotRigid;
  const GpuAsset& asset = args.assets[args.instances.asset[instance]].asset;
  return in_range(world_box(stored_pose(args, instance), asset.lower, asset.upper)) ? Status::kOk
                                                                                    : Status::kOutOfRange;
}

__device__ PairRecord make_record(const QueryArgs& args, const ObjectPair& pair) {
  const Asset &a = args.assets[args.instances.asset[pair.a]], &b = args.assets[args.instances.asset[pair.b]];
  RelativePose pose;
  const bool in_frame = relative_pose(stored_pose(args, pair.a), a.extent, stored_pose(args, pair.b),
                                      b.extent, pose) == RelativePoseStatus::kOk;
  const float error = in_frame ? frame_error(pose, a.extent, b.extent) : 0;
  PairRecord record = {};
  for (int i = 0; i < 3; ++i) {
    record.rotation[i] = {pose.rotation[i][0], pose.rotation[i][1], pose.rotation[i][2], pose.translation[i]};
    record.abs_rotation[i] = {pose.abs_rotation[i][0], pose.abs_rotation[i][1], pose.abs_rotation[i][2],
                              pose.slack_a[i]};
    record.slack_b[i] = pose.slack_b[i];
  }
  if (in_frame) record.oriented_slack = oriented_slack(pose, a.extent, b.extent);
  record.frame_error = error;
  record.blocks_a = a.asset.tree.blocks;
  record.blocks_b = b.asset.tree.blocks;
  record.triangles_a = a.asset.tree.triangles;
  record.triangles_b = b.asset.tree.triangles;
  record.root_a = a.root;
  record.root_b = b.root;
  record.instance_a = pair.a;
  record.instance_b = pair.b;
  record.in_frame = in_frame;
  return record;
}

__device__ void prepare_pair(const QueryArgs& args, std::uint32_t index) {
  const ObjectPair pair = args.given.pairs[index];
  if (pair.a >= args.instances.count || pair.b >= args.instances.count)
    return report_error(args, kPair, index, Status::kUnknownInstance);
  if (args.instances.asset[pair.a] >= args.asset_count || args.instances.asset[pair.b] >= args.asset_count)
    return;  // reported with the instance
  const PairRecord record = make_record(args, pair);
  args.pairs[index] = record;
  if (args.first_contact_only) args.met[index] = 0;
  if (record.in_frame == 0) args.world_pairs[atomicAdd(&args.state->world_pairs, 1u)] = index;
}

__global__ void __launch_bounds__(kThreads) prepare(const __grid_constant__ QueryArgs args) {
  let_next_kernel_begin();
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  const std::uint32_t pairs = pair_count(args);
  for (std::uint32_t i = first; i < pairs; i += step) prepare_pair(args, i);
  for (std::uint32_t i = step - 1 - first; i < args.instances.count;
       i += step) {  // by other threads, at first
    const Status status = check_instance(args, i);
    if (status != Status::kOk) report_error(args, kInstance, i, status);
  }
}

}  // namespace

cudaError_t prepare_pairs(const QueryArgs& args, cudaStream_t stream) {
  int device = 0, processors = 0;
  if (const cudaError_t error = cudaGetDevice(&device); error != cudaSuccess) return error;
  if (const cudaError_t error = cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device);
      error != cudaSuccess)
    return error;
  // After whatever kernel of the user's, and so after all of it.
  prepare<<<static_cast<unsigned>(processors) * 32, kThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
