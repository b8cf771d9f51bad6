#include "paper_engine_data.h"
#include "tandem/kernels/detail/frame_test.h"
#include "tandem/kernels/detail/triangle_test.h"
#include "tandem/kernels/world_box.h"

// What comes before the traversal, and the last stages of the triangle test. Compiled without fused
// operations, which their float64 arithmetic relies on.
namespace tandem::bench::paper {
namespace {

enum What : Counter { kInstance, kPair, kReach };  // the order in which errors count

__device__ void report_error(const QueryArgs& args, What what, Counter where, Status status) {
  atomicMax(&args.outcome->error, ~(what << 40 | where << 8 | static_cast<Counter>(status)));
}

/// The pose of stored coordinates.
__device__ Pose stored_pose(const QueryArgs& args, std::uint32_t instance) {
  return for_stored_coordinates(args.instances.pose[instance],
                                args.assets[args.instances.asset[instance]].asset.origin);
}

__device__ Status check_instance(const QueryArgs& args, std::uint32_t instance) {
  if (args.instances.asset[instance] >= args.asset_count) return Status::kUnknownAsset;
  if (!is_rigid(args.instances.pose[instance])) return Status::kPoseNotRigid;
  const GpuAsset& asset = args.assets[args.instances.asset[instance]].asset;
  return in_range(world_box(stored_pose(args, instance), asset.lower, asset.upper)) ? Status::kOk
                                                                                    : Status::kOutOfRange;
}

__device__ void prepare_pair(const QueryArgs& args, std::uint32_t index) {
  const ObjectPair pair = args.given.pairs[index];
  if (pair.a >= args.instances.count || pair.b >= args.instances.count)
    return report_error(args, kPair, index, Status::kUnknownInstance);
  const std::uint32_t asset_a = args.instances.asset[pair.a], asset_b = args.instances.asset[pair.b];
  if (asset_a >= args.asset_count || asset_b >= args.asset_count) return;  // reported with the instance
  const Asset &a = args.assets[asset_a], &b = args.assets[asset_b];
  RelativePose pose;
  if (relative_pose(stored_pose(args, pair.a), a.extent, stored_pose(args, pair.b), b.extent, pose) !=
      RelativePoseStatus::kOk)
    return report_error(args, kReach, index, Status::kOutOfRange);
  PairRecord record;
  for (int i = 0; i < 3; ++i) {
    const auto &r = pose.rotation[i], &m = pose.abs_rotation[i];
    record.rotation[i] = {r[0], r[1], r[2], pose.translation[i]};
    record.abs_rotation[i] = {m[0], m[1], m[2], pose.slack_a[i]};
    record.slack_b[i] = pose.slack_b[i];
  }
  record.frame_error = frame_error(pose, a.extent, b.extent);
  record.blocks_a = a.asset.tree.blocks;
  record.blocks_b = b.asset.tree.blocks;
  record.triangles_a = a.asset.tree.triangles;
  record.triangles_b = b.asset.tree.triangles;
  record.instance_a = pair.a;
  record.instance_b = pair.b;
  args.records[index] = record;
}

__global__ void __launch_bounds__(kThreads)
    prepare_all(const __grid_constant__ QueryArgs args, Entry* first_level) {
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  const std::uint32_t given = *args.given.count;
  const std::uint32_t room = min(args.record_room, args.given.capacity);
  for (std::uint32_t i = first; i < min(given, room); i += step) {
    prepare_pair(args, i);
    first_level[i] = {i, 0, 0};
  }
  for (std::uint32_t i = first; i < args.instances.count; i += step) {
    const Status status = check_instance(args, i);
    if (status != Status::kOk) report_error(args, kInstance, i, status);
  }
}

__global__ void measure_extents(Asset* assets, std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i < count) assets[i].extent = extent_of(assets[i].asset.tree.blocks[0]);
}

__device__ TrianglePair posed_pair(const QueryArgs& args, const Entry& candidate) {
  const PairRecord& record = args.records[candidate.pair];
  const Pose pose_a = stored_pose(args, record.instance_a), pose_b = stored_pose(args, record.instance_b);
  TrianglePair pair;
  for (int corner = 0; corner < 3; ++corner) {
    const float* p = record.triangles_a[candidate.a].corner[corner].position;
    const float* q = record.triangles_b[candidate.b].corner[corner].position;
    apply(pose_a, p[0], p[1], p[2], pair.a[corner]);
    apply(pose_b, q[0], q[1], q[2], pair.b[corner]);
  }
  return pair;
}

/// float32 corners in the frame of the first instance.
__device__ TrianglePair framed_pair(const QueryArgs& args, const Entry& candidate) {
  const PairRecord& record = args.records[candidate.pair];
  TrianglePair pair;
  for (int corner = 0; corner < 3; ++corner) {
    const float* p = record.triangles_a[candidate.a].corner[corner].position;
    const float* q = record.triangles_b[candidate.b].corner[corner].position;
    for (int i = 0; i < 3; ++i) {
      const float4 row = record.rotation[i];
      pair.a[corner][i] = static_cast<double>(p[i]);
      pair.b[corner][i] = static_cast<double>(((row.x * q[0] + row.y * q[1]) + row.z * q[2]) + row.w);
    }
  }
  return pair;
}

template <bool kFast>
__global__ void __launch_bounds__(kThreads)
    decide_by_float64(const __grid_constant__ QueryArgs args,
                      const __grid_constant__ TriangleArgs triangles) {
  const std::uint64_t total = min(args.outcome->undecided, static_cast<Counter>(triangles.undecided_room));
  const std::uint64_t step = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * kThreads; first < total; first += step) {
    const std::uint64_t i = first + threadIdx.x;
    const bool mine = i < total;
    const Entry candidate = triangles.undecided[mine ? i : first];
    const Verdict verdict =
        kFast ? decide_fast(framed_pair(args, candidate)) : decide_float64(posed_pair(args, candidate));
    const bool unresolved = mine && verdict == Verdict::undecided;
    const Counter place = place_for(unresolved, &args.outcome->unresolved);
    if (unresolved) triangles.unresolved[place] = candidate;
    place_for(mine && !kFast && !unresolved, &args.outcome->decided_by_float64);
    add_contact(args, triangles, candidate, mine && verdict == Verdict::contact);
  }
}

/// Apart from the others: it needs 3 KB of stack a thread.
__global__ void __launch_bounds__(kThreads)
    decide_exactly(const __grid_constant__ QueryArgs args, const __grid_constant__ TriangleArgs triangles) {
  const std::uint64_t total = args.outcome->unresolved, step = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * kThreads; first < total; first += step) {
    const std::uint64_t i = first + threadIdx.x;
    const bool mine = i < total;
    const Entry candidate = triangles.unresolved[mine ? i : first];
    const bool contact = mine && decide_exact(posed_pair(args, candidate)) == Verdict::contact;
    add_contact(args, triangles, candidate, contact);
  }
}

/// Thread blocks that fill the GPU a few times over.
cudaError_t block_count(unsigned& blocks) {
  int device = 0, processors = 0;
  cudaError_t error = cudaGetDevice(&device);
  if (error == cudaSuccess)
    error = cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device);
  blocks = static_cast<unsigned>(processors) * 8;
  return error;
}

}  // namespace

cudaError_t measure_assets(Asset* assets, std::uint32_t count, cudaStream_t stream) {
  measure_extents<<<(count + kThreads - 1) / kThreads, kThreads, 0, stream>>>(assets, count);
  return cudaGetLastError();
}

cudaError_t prepare(const QueryArgs& args, Entry* first_level, cudaStream_t stream) {
  unsigned blocks = 0;
  if (const cudaError_t error = block_count(blocks); error != cudaSuccess) return error;
  prepare_all<<<blocks, kThreads, 0, stream>>>(args, first_level);
  return cudaGetLastError();
}

cudaError_t decide_rest(const QueryArgs& args, const TriangleArgs& triangles, QueryMode mode,
                        cudaStream_t stream) {
  unsigned blocks = 0;
  if (const cudaError_t error = block_count(blocks); error != cudaSuccess) return error;
  const auto kernel = mode == QueryMode::fast ? decide_by_float64<true> : decide_by_float64<false>;
  kernel<<<blocks, kThreads, 0, stream>>>(args, triangles);
  if (mode == QueryMode::exact) decide_exactly<<<blocks, kThreads, 0, stream>>>(args, triangles);
  return cudaGetLastError();
}

}  // namespace tandem::bench::paper
