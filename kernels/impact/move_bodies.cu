#include "kernels/impact/impact_data.h"

// These kernels move bodies. They are compiled without fused operations: swept boxes have the bits of the
// CPU's.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 32;  // few, so that few bodies spread over all multiprocessors

__device__ Status move_body(const ImpactArgs& args, std::uint32_t i) {
  const GpuInstances& instances = args.instances;
  Pose stored;
  WorldBox box;
  args.boxes[i] = {};
  Status status =
      pose_instance(args.assets, args.asset_count, instances.asset[i], instances.pose[i], stored, box);
  if (status != Status::kOk) return status;
  const GpuAsset& asset = args.assets[instances.asset[i]];
  impact::MovingBody body;
  status = moving_body(stored, args.motion[i], args.duration, asset.lower, asset.upper, asset.extent, body);
  if (status != Status::kOk) return status;
  args.bodies[i] = body;
  args.boxes[i] = swept_box(box, body.displacement, body.turn, body.fastest, body.error);
  return Status::kOk;
}

__global__ void __launch_bounds__(kThreads) move(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  for (std::uint32_t i = first_of_thread(); i < args.instances.count; i += threads_of_grid()) {
    const Status status = move_body(args, i);
    if (status != Status::kOk) atomicMax(&args.state->error, packed_error(Subject::instance, i, status));
  }
}

}  // namespace

cudaError_t move_bodies(const ImpactArgs& args, cudaStream_t stream) {
  const std::uint32_t wanted = args.instances.count / kThreads + 1, most = args.limits.processors * 32;
  return launch_after({wanted < most ? wanted : most, kThreads, 0, stream, args.limits.early_launch}, move,
                      args);
}

}  // namespace tandem::gpu
