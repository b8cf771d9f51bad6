// Measures what bounds a query: how fast memory is copied on the GPU, and how fast a plain kernel, one thread
// a block pair, tests a queue of ready block pairs. Usage: gpu_ceilings MESH.bvh   Prints JSON.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "kernels/geometry/box_test.h"
#include "kernels/geometry/relative_pose.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_stream.h"
#include "tandem/runtime/map.h"
#include "tandem/runtime/upload.h"

namespace {

using namespace tandem;

struct Ready {
  std::uint32_t pose, a, b;
};

void require(cudaError_t error) {
  if (error == cudaSuccess) return;
  std::printf("gpu_ceilings: %s\n", cudaGetErrorString(error));
  std::exit(2);
}

__device__ Block load(const Block* block) {
  Block out;
  const auto* from = reinterpret_cast<const float4*>(block);
  auto* to = reinterpret_cast<float4*>(&out);
#pragma unroll
  for (int i = 0; i < 8; ++i) to[i] = __ldg(from + i);
  return out;
}

template <bool kAllAxes>
__global__ void test_queue(const Ready* queue, std::uint32_t count, const Block* blocks,
                           const RelativePose* poses, std::uint16_t* masks) {
  const std::uint32_t n = blockIdx.x * blockDim.x + threadIdx.x;
  if (n >= count) return;
  const Ready ready = queue[n];
  const Block a = load(blocks + ready.a), b = load(blocks + ready.b);
  const RelativePose pose = poses[ready.pose];
  std::uint32_t mask = 0;
#pragma unroll
  for (int i = 0; i < kNodesPerBlock; ++i) {
#pragma unroll
    for (int j = 0; j < kNodesPerBlock; ++j) {
      const bool hit = kAllAxes ? overlap_15_axes(box_of(a, i), box_of(b, j), pose)
                                : overlap_6_axes(box_of(a, i), box_of(b, j), pose);
      mask |= static_cast<std::uint32_t>(hit) << (4 * i + j);
    }
  }
  masks[n] = static_cast<std::uint16_t>(mask);
}

/// Best and median of many runs, milliseconds.
struct Times {
  double best, median;
};

template <typename Work>
Times time(const Work& work) {
  std::vector<double> times;
  GpuEvent begin, end;
  require(begin.create());
  require(end.create());
  for (int i = 0; i < 24; ++i) {
    require(begin.record(nullptr));
    work();
    require(end.record(nullptr));
    require(cudaDeviceSynchronize());
    float ms = 0;
    require(milliseconds_between(begin, end, ms));
    if (i >= 3) times.push_back(static_cast<double>(ms));
  }
  std::sort(times.begin(), times.end());
  return {times[0], times[times.size() / 2]};
}

template <typename Element>
GpuArray<Element> to_gpu(const std::vector<Element>& host) {
  GpuArray<Element> array;
  require(array.upload(host, nullptr));
  return array;
}

Pose random_pose(std::mt19937_64& random, double distance) {
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  double q[4], length;
  do {
    length = 0;
    for (double& x : q) x = uniform(), length += x * x;
  } while (length > 1 || length < 0.01);
  const double s = 2 / length, w = q[0], x = q[1], y = q[2], z = q[3];
  return {{{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
           {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
           {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}},
          {distance * uniform(), distance * uniform(), distance * uniform()}};
}

// The block pairs that a traversal of the tree against itself visits, both descending, depth first.
void walk(const LevelView& tree, const RelativePose& pose, Ready top, std::vector<Ready>& queue) {
  std::vector<Ready> stack = {top};
  while (!stack.empty()) {
    const Ready ready = stack.back();
    stack.pop_back();
    queue.push_back(ready);
    const Block &a = tree.blocks[ready.a], &b = tree.blocks[ready.b];
    if (a.is_leaf_block() && b.is_leaf_block()) continue;
    for (int i = 0; i < kNodesPerBlock; ++i) {
      for (int j = 0; j < kNodesPerBlock; ++j) {
        if (!overlap_15_axes(box_of(a, i), box_of(b, j), pose)) continue;
        const Ready next = {ready.pose, a.is_leaf_block() ? ready.a : a.index[i],
                            b.is_leaf_block() ? ready.b : b.index[j]};
        const bool twice = (a.is_leaf_block() || b.is_leaf_block()) && !stack.empty() &&
                           stack.back().a == next.a && stack.back().b == next.b;
        if (!twice) stack.push_back(next);
      }
    }
  }
}

struct Queue {
  std::vector<Ready> ready;
  std::vector<RelativePose> poses;
};

// Real work, in the order of a traversal: of bodies at random rotations that lie close, until there is
// enough.
Queue make_queue(const AssetView& asset, std::size_t enough) {
  Queue queue;
  std::mt19937_64 random(1);
  const LevelView& tree = asset.level();
  const TreeExtent extent = extent_of(tree.blocks[0]);
  const double size =
      static_cast<double>(asset.header->upper[0]) - static_cast<double>(asset.header->lower[0]);
  while (queue.ready.size() < enough) {
    RelativePose pose;
    const auto at = static_cast<std::uint32_t>(queue.poses.size());
    if (relative_pose(kIdentityPose, extent, random_pose(random, 0.7 * size), extent, pose) !=
        RelativePoseStatus::kOk)
      continue;
    queue.poses.push_back(pose);
    walk(tree, pose, {at, 0, 0}, queue.ready);
  }
  queue.ready.resize(enough);
  return queue;
}

double copy_gigabytes_per_second(double Times::*which) {
  constexpr std::size_t kBytes = std::size_t{1} << 30;
  GpuArray<unsigned char> from, to;
  require(from.reserve(kBytes));
  require(to.reserve(kBytes));
  require(cudaMemset(from.data(), 0x5A, kBytes));
  const Times times =
      time([&] { require(cudaMemcpyAsync(to.data(), from.data(), kBytes, cudaMemcpyDeviceToDevice)); });
  return 2e-6 * static_cast<double>(kBytes) / (times.*which);
}

}  // namespace

int main(int argc, char** argv) {
  MappedAsset file;
  if (argc != 2 || file.open(argv[1]) != Status::kOk) return std::puts("usage: gpu_ceilings MESH.bvh"), 1;
  cudaDeviceProp properties;
  require(cudaGetDeviceProperties(&properties, 0));
  DeviceAssets uploaded;
  if (uploaded.upload({&file.view(), 1}, Contents::all, nullptr) != Status::kOk)
    return std::puts("upload failed"), 2;
  constexpr std::uint32_t kReady = 1u << 24;
  const Queue queue = make_queue(file.view(), kReady);
  const auto ready = to_gpu(queue.ready);
  const auto poses = to_gpu(queue.poses);
  const auto masks = to_gpu(std::vector<std::uint16_t>(kReady, 0));
  const Block* blocks = uploaded.level(0).blocks;
  const auto rate = [&](auto kernel) {
    const Times times = time([&] {
      kernel<<<kReady / 256, 256>>>(ready.data(), kReady, blocks, poses.data(), masks.data());
      require(cudaGetLastError());
    });
    return 1e-6 * kReady / times.median;
  };
  const double rate_15 = rate(test_queue<true>), rate_6 = rate(test_queue<false>);
  std::vector<std::uint16_t> hits(kReady);
  require(tandem::download<std::uint16_t>(masks.data(), hits, nullptr));
  std::uint64_t hit = 0;
  for (const std::uint16_t mask : hits) hit += static_cast<std::uint64_t>(__builtin_popcount(mask));
  std::printf(
      "{\"gpu\": \"%s\", \"copy_gb_per_s\": %.0f, \"ready_15_axes_g_per_s\": %.2f, \"ready_6_axes_g_per_s\": "
      "%.2f, "
      "\"ready_hit_share\": %.3f}\n",
      properties.name, copy_gigabytes_per_second(&Times::median), rate_15, rate_6,
      static_cast<double>(hit) / (16.0 * kReady));
}
