#include <algorithm>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "kernels/common/cub_code.cuh"
#include "kernels/points_and_rays/probe_data.h"

// Records of bodies, the tree of their world boxes, and the order of the probes. Compiled without fused
// operations, so that poses, and what is proved of frames, are those of the CPU.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;
constexpr int kAxisBits = 10, kKeyBits = 3 * kAxisBits;
constexpr std::uint32_t kLastKey = ~0u;  // sorted by one bit more than others have

__device__ void report_error(const ProbeArgs& args, Subject subject, Counter where, Status status) {
  atomicMax(&args.counts->error, packed_error(subject, where, status));
}

/// number = max(number, x), sparing the atomic operation where it would change nothing.
__device__ void raise(Counter& number, Counter x) {
  if (x > *static_cast<volatile Counter*>(&number)) atomicMax(&number, x);
}

__device__ WorldBox nothing() {
  return {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

__device__ WorldBox make_body(const ProbeArgs& args, std::uint32_t i, ProbedBody& body) {
  const std::uint32_t number = args.instances.asset[i];
  WorldBox box;
  const Status status =
      pose_instance(args.assets, args.asset_count, number, args.instances.pose[i], body.pose, box);
  if (status != Status::kOk) {
    report_error(args, Subject::instance, i, status);
    return nothing();
  }
  const GpuAsset& asset = args.assets[number];
  body.frame = local_frame(body.pose, asset.extent, asset.lower, asset.upper);
  body.blocks = asset.tree.blocks;
  body.triangles = asset.tree.triangles;
  body.precise = asset.tree.precise;
  body.asset = number;
  return box;
}

__global__ void __launch_bounds__(kThreads)
    make_bodies(const __grid_constant__ ProbeArgs args, const std::uint8_t* looked_at) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= args.instances.count) return;
  args.bodies[i] = {};
  const bool passed_over = looked_at != nullptr && looked_at[i] == 0;
  const WorldBox box = passed_over ? nothing() : make_body(args, i, args.bodies[i]);
  args.boxes[i] = box;
  if (!(box.lo[0] <= box.hi[0])) return;
  for (int k = 0; k < 3; ++k) {
    raise(args.counts->bounds[k], ~as_ordered(box.lo[k]));
    raise(args.counts->bounds[3 + k], as_ordered(box.hi[k]));
  }
}

/// The place of a point on Morton's curve through a box; what lies beside it counts as at its side.
__device__ std::uint32_t key_of(const WorldBox& bounds, const double (&at)[3]) {
  constexpr double kSteps = 1 << kAxisBits;
  std::uint32_t step[3];
  for (int k = 0; k < 3; ++k) {
    const double size = bounds.hi[k] - bounds.lo[k], x = (at[k] - bounds.lo[k]) / size * kSteps;
    step[k] = !(x > 0) ? 0 : x < kSteps ? static_cast<std::uint32_t>(x) : (1 << kAxisBits) - 1;
  }
  std::uint32_t key = 0;
  for (int bit = kAxisBits - 1; bit >= 0; --bit) {
    for (int k = 0; k < 3; ++k) key = key << 1 | (step[k] >> bit & 1);
  }
  return key;
}

__global__ void __launch_bounds__(kThreads) make_body_keys(const __grid_constant__ ProbeArgs args) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= args.instances.count) return;
  const WorldBox box = args.boxes[i];
  double centre[3];
  for (int k = 0; k < 3; ++k) centre[k] = 0.5 * box.lo[k] + 0.5 * box.hi[k];
  args.body_keys[i] = box.lo[0] <= box.hi[0] ? key_of(bounds_of(*args.counts), centre) : kLastKey;
  args.body_numbers[i] = i;
}

/// The box below a place of a level; nothing beyond the last.
__device__ WorldBox box_below(const ProbeArgs& args, int level, std::uint32_t place) {
  if (level == 0) {
    return place < args.instances.count ? args.boxes[args.body_numbers[args.instances.count + place]]
                                        : nothing();
  }
  if (place >= args.level_begin[level] - args.level_begin[level - 1]) return nothing();
  const BoxTree::Group& group = args.groups[args.level_begin[level - 1] + place];
  WorldBox box = nothing();
  for (int i = 0; i < BoxTree::kGroup; ++i) {
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = fmin(box.lo[k], group.lo[k][i]);
      box.hi[k] = fmax(box.hi[k], group.hi[k][i]);
    }
  }
  return box;
}

__global__ void __launch_bounds__(kThreads) make_level(const __grid_constant__ ProbeArgs args, int level) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= args.level_begin[level + 1] - args.level_begin[level]) return;
  BoxTree::Group& group = args.groups[args.level_begin[level] + i];
  for (std::uint32_t j = 0; j < BoxTree::kGroup; ++j) {
    const WorldBox box = box_below(args, level, BoxTree::kGroup * i + j);
    for (int k = 0; k < 3; ++k) group.lo[k][j] = box.lo[k], group.hi[k][j] = box.hi[k];
  }
}

/// The order of a point; reports what is wrong with it.
__device__ std::uint32_t probe_key(const PointArgs& args, std::uint32_t i) {
  const double* const p = args.asked.points + std::uint64_t{3} * i;
  if (!probe::is_in_range(p)) report_error(args, kProbe, i, Status::kOutOfRange);
  // Points beside the bodies are told apart up to half their size away.
  WorldBox bounds = bounds_of(*args.counts);
  double at[3];
  for (int k = 0; k < 3; ++k) {
    const double half = 0.5 * bounds.hi[k] - 0.5 * bounds.lo[k];
    bounds.lo[k] -= half;
    bounds.hi[k] += half;
    at[k] = p[k];
  }
  return key_of(bounds, at);
}

__device__ Status check_ray(const double* origin, const double* direction) {
  if (!probe::is_in_range(origin) || !probe::is_in_range(direction)) return Status::kOutOfRange;
  return direction[0] == 0 && direction[1] == 0 && direction[2] == 0 ? Status::kNoDirection : Status::kOk;
}

/// The order of a ray, in which rays that enter the scene near each other follow each other.
__device__ std::uint32_t probe_key(const RayArgs& args, std::uint32_t i) {
  const double* const origin = args.asked.origins + std::uint64_t{3} * i;
  const double* const direction = args.asked.directions + std::uint64_t{3} * i;
  if (const Status status = check_ray(origin, direction); status != Status::kOk) {
    report_error(args, kProbe, i, status);
    return 0;
  }
  const WorldBox bounds = bounds_of(*args.counts);
  const WorldRay ray = world_ray(origin, direction, INFINITY);
  double first = 0, last = INFINITY, at[3];
  if (!meets_box(ray, bounds.lo, bounds.hi, first, last)) first = 0;
  for (int k = 0; k < 3; ++k) at[k] = ray.origin[k] + first * ray.scaled[k];
  return key_of(bounds, at);
}

template <typename Options>
__global__ void __launch_bounds__(kThreads) make_probe_keys(const __grid_constant__ AskedArgs<Options> args) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= args.probe_count) return;
  args.probe_keys[i] = probe_key(args, i);
  args.probe_numbers[i] = i;
}

std::uint32_t blocks_for(std::uint32_t count) {
  return (count + kThreads - 1) / kThreads;
}

/// Sorts the first `count` numbers by their keys to the second.
cudaError_t sort(const ProbeArgs& args, std::uint32_t* keys, std::uint32_t* numbers, std::uint32_t count,
                 cudaStream_t stream) {
  std::size_t bytes = args.scratch_bytes;
  return cub::DeviceRadixSort::SortPairs(args.scratch, bytes, keys, keys + count, numbers, numbers + count,
                                         count, 0, kKeyBits + 1, stream);
}

cudaError_t prepare_bodies(const ProbeArgs& args, const std::uint8_t* looked_at, cudaStream_t stream) {
  const std::uint32_t count = args.instances.count;
  if (count == 0) return cudaSuccess;
  make_bodies<<<blocks_for(count), kThreads, 0, stream>>>(args, looked_at);
  make_body_keys<<<blocks_for(count), kThreads, 0, stream>>>(args);
  cudaError_t error = cudaGetLastError();
  if (error == cudaSuccess) error = sort(args, args.body_keys, args.body_numbers, count, stream);
  for (int level = 0; level < args.levels && error == cudaSuccess; ++level) {
    make_level<<<blocks_for(args.level_begin[level + 1] - args.level_begin[level]), kThreads, 0, stream>>>(
        args, level);
    error = cudaGetLastError();
  }
  return error;
}

}  // namespace

void set_levels(ProbeArgs& args) {
  args.levels = 0;
  std::uint32_t count = args.instances.count;
  args.level_begin[0] = 0;
  do {
    count = count / BoxTree::kGroup + (count % BoxTree::kGroup != 0);
    args.level_begin[args.levels + 1] = args.level_begin[args.levels] + count;
    ++args.levels;
  } while (count > 1);
}

cudaError_t probe_scratch_bytes(std::uint32_t instances, std::uint32_t probes, std::size_t& bytes) {
  if (const cudaError_t error = load_cub_code(); error != cudaSuccess) return error;
  std::uint32_t* const none = nullptr;
  std::size_t to_sort = 0, to_add = 0;
  const std::uint32_t most = std::max(instances, probes);
  cudaError_t error =
      cub::DeviceRadixSort::SortPairs(nullptr, to_sort, none, none, none, none, most, 0, kKeyBits + 1);
  if (error == cudaSuccess)
    error = cub::DeviceScan::ExclusiveSum(nullptr, to_add, none, none, std::uint64_t{probes} + 1);
  bytes = std::max(to_sort, to_add);
  return error;
}

template <typename Options>
cudaError_t prepare_probes(const AskedArgs<Options>& args, cudaStream_t stream) {
  cudaError_t error = prepare_bodies(args, args.asked.looked_at, stream);
  if (error != cudaSuccess || args.probe_count == 0) return error;
  make_probe_keys<<<blocks_for(args.probe_count), kThreads, 0, stream>>>(args);
  error = cudaGetLastError();
  return error == cudaSuccess ? sort(args, args.probe_keys, args.probe_numbers, args.probe_count, stream)
                              : error;
}

template cudaError_t prepare_probes(const PointArgs&, cudaStream_t);
template cudaError_t prepare_probes(const RayArgs&, cudaStream_t);

}  // namespace tandem::gpu
