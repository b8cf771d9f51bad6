#pragma once
#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

#include "kernels/common/instance_check.h"
#include "kernels/geometry/clearance.h"
#include "kernels/geometry/frame_test.h"
#include "kernels/geometry/oriented_test.h"
#include "kernels/geometry/relative_pose.h"
#include "tandem/kernels/gpu_contact_query.h"

// Every engine on the GPU keeps these records of assets and object pairs, and its lanes share arrays in this
// way.
namespace tandem::gpu {

using Counter = unsigned long long;                   // what atomicAdd takes
inline constexpr Counter kNoTriangles = ~Counter{0};  // where two triangles are kept as one number

/// The record of an object pair that the walk needs, in whole float4.
struct alignas(16) PairRecord {
  float4 rotation[3];      ///< of RelativePose; w: translation
  float4 abs_rotation[3];  ///< w: slack_a
  float slack_b[3];
  float oriented_slack;
  float frame_error;
  std::uint32_t in_frame;  ///< float32 can take the pair
  std::uint32_t instance_a, instance_b;
  const Triangle *triangles_a, *triangles_b;
  union {  ///< which of them, the record's maker says
    const Block* blocks_a;
    const OrientedBlock* oriented_a;
  };
  union {
    const Block* blocks_b;
    const OrientedBlock* oriented_b;
  };
};
static_assert(sizeof(PairRecord) == 160);

/// Says which blocks of a tree are walked.
enum class BlockKind : std::uint8_t { axis_aligned, oriented };

/// Says what an error is about, in the order of the CPU's checks.
enum class Subject : Counter { instance, pair, reach, topology };

/// An error as one number, of which the largest wins: that of the first subject, and of those the first.
__host__ __device__ constexpr Counter packed_error(Subject subject, Counter where, Status status) {
  return ~(static_cast<Counter>(subject) << 40 | where << 8 | static_cast<Counter>(status));
}
__host__ __device__ constexpr Status status_in(Counter error) {
  return static_cast<Status>(~error & 0xFFu);
}
__host__ __device__ constexpr std::uint64_t where_in(Counter error) {
  return ~error >> 8 & 0xFFFFFFFFu;
}

#ifdef __CUDACC__

__device__ inline std::uint32_t lane_id() {
  return threadIdx.x % 32;
}
inline constexpr std::uint32_t kAllLanes = 0xFFFFFFFFu;

__device__ inline std::uint32_t lanes_below() {
  return (1u << lane_id()) - 1;
}

/// A place for each lane that asks for one, all lanes of a warp taking part: one atomic a warp.
__device__ inline Counter place_for(bool wanted, Counter* counter) {
  const std::uint32_t lanes = __ballot_sync(kAllLanes, wanted);
  if (lanes == 0) return 0;
  Counter first = 0;
  if (lane_id() == 0) first = atomicAdd(counter, static_cast<Counter>(__popc(lanes)));
  return __shfl_sync(kAllLanes, first, 0) + __popc(lanes & lanes_below());
}

/// Returns the pose by plain loads: a kernel that is launched early may be there while the records are made,
/// and what __ldg() loads must not change while a kernel runs.
__device__ inline RelativePose pose_of(const PairRecord& record) {
  RelativePose pose;
#pragma unroll
  for (int i = 0; i < 3; ++i) {
    const float4 r = record.rotation[i], m = record.abs_rotation[i];
    pose.rotation[i][0] = r.x, pose.rotation[i][1] = r.y, pose.rotation[i][2] = r.z;
    pose.translation[i] = r.w;
    pose.abs_rotation[i][0] = m.x, pose.abs_rotation[i][1] = m.y, pose.abs_rotation[i][2] = m.z;
    pose.slack_a[i] = m.w;
  }
  const auto& last = *reinterpret_cast<const float4*>(record.slack_b);
  pose.slack_b[0] = last.x, pose.slack_b[1] = last.y, pose.slack_b[2] = last.z;
  return pose;
}

/// Stores the pose that pose_of() gives back.
__device__ inline void set_pose(const RelativePose& pose, PairRecord& record) {
  for (int i = 0; i < 3; ++i) {
    const auto &r = pose.rotation[i], &m = pose.abs_rotation[i];
    record.rotation[i] = {r[0], r[1], r[2], pose.translation[i]};
    record.abs_rotation[i] = {m[0], m[1], m[2], pose.slack_a[i]};
    record.slack_b[i] = pose.slack_b[i];
  }
}

/// The pose of stored coordinates.
__device__ inline Pose stored_pose(const GpuInstances& instances, const GpuAsset* assets,
                                   std::uint32_t instance) {
  return for_stored_coordinates(instances.pose[instance], assets[instances.asset[instance]].origin);
}

template <typename Args>
__device__ inline Pose stored_pose(const Args& args, std::uint32_t instance) {
  return stored_pose(args.instances, args.assets, instance);
}

/// Returns how many of the given object pairs a query looks at: those that there are and that have room.
template <typename Args>
__device__ inline std::uint32_t pair_count(const Args& args) {
  const std::uint32_t count = *args.given.count;
  const std::uint32_t room =
      args.given.capacity < args.capacity.pairs ? args.given.capacity : args.capacity.pairs;
  return count < room ? count : room;
}

__device__ inline Status check_instance(const GpuInstances& instances, const GpuAsset* assets,
                                        std::uint32_t asset_count, std::uint32_t instance) {
  Pose stored;
  WorldBox box;
  return pose_instance(assets, asset_count, instances.asset[instance], instances.pose[instance], stored, box);
}

/// The record of a pair whose two instances have these poses, of stored coordinates, for walks of such
/// blocks. within: with slack for what is so far apart, of which `clearance` tells. With 0 that tells what
/// meets.
__device__ inline PairRecord make_record(const ObjectPair& pair, const GpuAsset& a, const Pose& pose_a,
                                         const GpuAsset& b, const Pose& pose_b, BlockKind kind, double within,
                                         distance::FrameClearance& clearance) {
  RelativePose pose;
  bool in_frame = relative_pose(pose_a, a.extent, pose_b, b.extent, pose) == RelativePoseStatus::kOk;
  float error = 0, slack = 0;
  if (in_frame) error = frame_error(pose, a.extent, b.extent);
  clearance = {0, -1, error};
  if (within > 0 && in_frame) {
    const RelativePose of_contacts = pose;
    in_frame = distance::ask_for_clearance(pose_a, within, pose, error, clearance);
    if (in_frame && kind == BlockKind::oriented)
      slack = oriented_slack(of_contacts, a.extent, b.extent, clearance.apart_from);
  } else if (in_frame && kind == BlockKind::oriented) {
    slack = oriented_slack(pose, a.extent, b.extent);
  }
  PairRecord record = {};
  set_pose(pose, record);
  record.frame_error = error;
  if (kind == BlockKind::oriented) {
    record.oriented_slack = slack;
    record.oriented_a = a.tree.oriented_blocks;
    record.oriented_b = b.tree.oriented_blocks;
  } else {
    record.blocks_a = a.tree.blocks;
    record.blocks_b = b.tree.blocks;
  }
  record.triangles_a = a.tree.triangles;
  record.triangles_b = b.tree.triangles;
  record.instance_a = pair.a;
  record.instance_b = pair.b;
  record.in_frame = in_frame;
  return record;
}

/// Makes the record of a pair whose contacts are asked for.
__device__ inline PairRecord make_record(const ObjectPair& pair, const GpuAsset& a, const Pose& pose_a,
                                         const GpuAsset& b, const Pose& pose_b, BlockKind kind) {
  distance::FrameClearance none;
  return make_record(pair, a, pose_a, b, pose_b, kind, 0, none);
}

/// Makes the record of a pair of instances, whose assets must exist, at the poses that they have.
__device__ inline PairRecord make_record(const GpuInstances& instances, const GpuAsset* assets,
                                         const ObjectPair& pair, BlockKind kind, double within,
                                         distance::FrameClearance& clearance) {
  return make_record(pair, assets[instances.asset[pair.a]], stored_pose(instances, assets, pair.a),
                     assets[instances.asset[pair.b]], stored_pose(instances, assets, pair.b), kind, within,
                     clearance);
}
__device__ inline PairRecord make_record(const GpuInstances& instances, const GpuAsset* assets,
                                         const ObjectPair& pair, BlockKind kind) {
  distance::FrameClearance none;
  return make_record(instances, assets, pair, kind, 0, none);
}

#endif

}  // namespace tandem::gpu
