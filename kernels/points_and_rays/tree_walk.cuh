#pragma once
#include "kernels/common/traversal.h"
#include "kernels/geometry/frame_probe.h"
#include "kernels/points_and_rays/probe_data.h"

// Walks of one tree by a thread, of a point or a ray in the body's frame: the tests of frame_probe.h, as
// those on the CPU, the nearest nodes first. A block is a cache line, which threads beside each other read
// together.
namespace tandem::gpu {
namespace {

/// The nodes that wait to be visited: on each level three beside the one that is taken next.
struct WaitingBlock {
  std::uint32_t block;
  float near;
};
constexpr std::uint32_t kMostWaiting = 3 * kMaxDepth + 1;

/// The nodes of a block that count, the nearest first; others are at infinity.
struct NodeOrder {
  float near[kNodesPerBlock];
  std::uint32_t node[kNodesPerBlock];

  __device__ void sort(int i, int j) {
    const bool turned = near[j] < near[i];
    const float less = turned ? near[j] : near[i], more = turned ? near[i] : near[j];
    const std::uint32_t first = turned ? node[j] : node[i], second = turned ? node[i] : node[j];
    near[i] = less, near[j] = more;
    node[i] = first, node[j] = second;
  }
  __device__ void sort() {
    sort(0, 1);
    sort(2, 3);
    sort(0, 2);
    sort(1, 3);
    sort(1, 2);
  }
};

/// A block as a thread has it in registers.
struct LoadedBlock {
  float centre[3][kNodesPerBlock], half_extent[3][kNodesPerBlock];
  std::uint32_t index[kNodesPerBlock];
  bool is_leaf_block;

  __device__ explicit LoadedBlock(const Block& block) {
    const auto* const parts = reinterpret_cast<const float4*>(&block);
#pragma unroll
    for (int k = 0; k < 3; ++k) {
      set(parts[k], centre[k]);
      set(parts[3 + k], half_extent[k]);
    }
    const uint4 of = reinterpret_cast<const uint4*>(&block)[6];
    index[0] = of.x, index[1] = of.y, index[2] = of.z, index[3] = of.w;
    is_leaf_block = block.is_leaf_block();
  }

 private:
  __device__ static void set(const float4& part, float (&out)[kNodesPerBlock]) {
    out[0] = part.x, out[1] = part.y, out[2] = part.z, out[3] = part.w;
  }
};

__device__ inline void load_corners(const Triangle& triangle, frame::Point<float> (&corner)[3]) {
  const auto* const parts = reinterpret_cast<const float4*>(&triangle);
#pragma unroll
  for (int c = 0; c < 3; ++c) {
    const float4 part = parts[c];
    corner[c].x[0] = part.x, corner[c].x[1] = part.y, corner[c].x[2] = part.z;
  }
}
static_assert(sizeof(Triangle) == 3 * sizeof(float4) && alignof(Triangle) >= alignof(float4));

/// Visits the blocks of a tree. near(centre, half_extent) -> a bound of a node, infinity where it does not
/// count; counts(bound) -> whether it still does; take(triangle) -> whether the walk goes on. Result: whether
/// it came to its end.
template <typename Near, typename Counts, typename Take>
__device__ bool walk(const Block* blocks, Counter& looked_at, const Near& near, const Counts& counts,
                     const Take& take) {
  WaitingBlock stack[kMostWaiting];
  std::uint32_t height = 0, number = 0;
  for (;;) {
    const LoadedBlock block(blocks[number]);
    ++looked_at;
    NodeOrder order;
#pragma unroll
    for (int i = 0; i < kNodesPerBlock; ++i) {
      const float centre[3] = {block.centre[0][i], block.centre[1][i], block.centre[2][i]},
                  half_extent[3] = {block.half_extent[0][i], block.half_extent[1][i],
                                    block.half_extent[2][i]};
      order.near[i] = near(centre, half_extent);
      order.node[i] = block.index[i];
    }
    order.sort();
    bool goes_down = false;
    if (block.is_leaf_block) {
      for (int i = 0; i < kNodesPerBlock; ++i) {
        if (!(order.near[i] < INFINITY) || !counts(order.near[i])) break;
        if (!take(order.node[i])) return false;
      }
    } else {
#pragma unroll
      for (int i = kNodesPerBlock - 1; i > 0; --i) {
        if (order.near[i] < INFINITY) stack[height++] = {order.node[i], order.near[i]};
      }
      goes_down = order.near[0] < INFINITY;
      number = order.node[0];
    }
    while (!goes_down) {
      if (height == 0) return true;
      const WaitingBlock next = stack[--height];
      goes_down = counts(next.near);
      number = next.block;
    }
  }
}

/// The walk of a ray: take(triangle, limit) -> whether the walk goes on, of triangles that float32 does not
/// rule out; limit: the parameter of the local ray up to which others count, which it may lessen.
template <typename Take>
__device__ bool walk_ray(const ProbedBody& body, const LocalRay& ray, Counter& looked_at, const Take& take) {
  const probe::RayInFrame<float> in_frame = probe::ray_in_frame<float>(ray);
  float limit = ray.length;
  return walk(
      body.blocks, looked_at,
      [&](const float(&centre)[3], const float(&half_extent)[3]) {
        float first;
        const bool misses = probe::misses_box(in_frame, centre, half_extent, limit, first);
        return misses ? INFINITY : first;
      },
      [&](float near) { return near <= limit; },
      [&](std::uint32_t triangle) {
        frame::Point<float> corner[3];
        load_corners(body.triangles[triangle], corner);
        return probe::passes_triangle(ray, in_frame.o, corner) || take(triangle, limit);
      });
}

}  // namespace
}  // namespace tandem::gpu
