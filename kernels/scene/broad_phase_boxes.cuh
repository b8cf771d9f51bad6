#pragma once
#include "kernels/common/instance_check.h"
#include "kernels/common/launch.h"
#include "kernels/scene/broad_phase_tree.cuh"

// A broad phase gets its world boxes from these, by place among those that it looks at; number() is the box's
// or instance's own. They are compiled without fused operations, so that is_rigid() is the CPU's too.
namespace tandem {
namespace {

// They lie in GPU memory.
struct GivenBoxes {
  static constexpr bool kPosed = false;
  const WorldBox* boxes;

  // Returns these boxes, or grown ones, where they lie once they have been taken.
  GivenBoxes lying_at(const WorldBox* taken) const { return {taken}; }

  __device__ std::uint32_t number(std::uint32_t i) const { return i; }
  __device__ Status get(std::uint32_t i, WorldBox& box) const {
    box = load(boxes, i);
    return in_range(box) ? Status::kOk : Status::kOutOfRange;
  }
  __device__ void keep(std::uint32_t, const WorldBox&) const {}
  // Somewhere near the box.
  __device__ double near(std::uint32_t i, int axis) const { return boxes[i].lo[axis]; }
};

// They are those of instances, and to be kept.
struct PosedBoxes {
  static constexpr bool kPosed = true;
  GpuInstances instances;
  GpuAssetBounds assets;
  WorldBox* kept;

  GivenBoxes lying_at(const WorldBox* taken) const { return {taken}; }
  __device__ std::uint32_t number(std::uint32_t i) const { return i; }
  __device__ Status get(std::uint32_t i, WorldBox& box) const {
    box = {};
    Pose stored;
    return pose_instance(assets.bounds, assets.count, instances.asset[i], instances.pose[i], stored, box);
  }
  __device__ void keep(std::uint32_t i, const WorldBox& box) const { kept[i] = box; }
  __device__ double near(std::uint32_t i, int axis) const { return instances.pose[i].translation[axis]; }
};

// Some of these.
template <typename Boxes>
struct Listed {
  static constexpr bool kPosed = Boxes::kPosed;
  Boxes all;
  const std::uint32_t* list;  // their numbers, ascending

  Listed<GivenBoxes> lying_at(const WorldBox* taken) const { return {all.lying_at(taken), list}; }

  __device__ std::uint32_t number(std::uint32_t i) const { return list[i]; }
  __device__ Status get(std::uint32_t i, WorldBox& box) const { return all.get(list[i], box); }
  __device__ void keep(std::uint32_t i, const WorldBox& box) const { all.keep(list[i], box); }
  __device__ double near(std::uint32_t i, int axis) const { return all.near(list[i], axis); }
};

// Gets box i for good: says what is wrong with it, and keeps it. Result: whether nothing is.
template <typename Boxes>
__device__ bool take(const Boxes& boxes, std::uint32_t i, Counters* counters, WorldBox& box) {
  const Status status = boxes.get(i, box);
  boxes.keep(i, box);
  if (status == Status::kOk) return true;
  blame(counters, boxes.number(i), status);
  return false;
}

template <typename Boxes>
__global__ void pose_boxes(const __grid_constant__ Boxes boxes, std::uint32_t count, Counters* counters) {
  gpu::wait_for_kernel_before();
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  WorldBox box;
  if (i < count) take(boxes, i, counters, box);
}

// Boxes that are larger by `margin`, by their numbers; nothing is wrong with any of them.
template <typename Boxes>
__global__ void grow_boxes(const __grid_constant__ Boxes boxes, std::uint32_t count, double margin,
                           WorldBox* larger, Counters* counters) {
  gpu::wait_for_kernel_before();
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  WorldBox box;
  const Status status = boxes.get(i, box);
  if (status != Status::kOk) blame(counters, boxes.number(i), status);
  larger[boxes.number(i)] = status == Status::kOk ? grown(box, margin) : WorldBox{};
}

}  // namespace
}  // namespace tandem
