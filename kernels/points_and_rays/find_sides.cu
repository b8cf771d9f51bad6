#include "kernels/geometry/inside_test.h"
#include "kernels/points_and_rays/tree_walk.cuh"

// Finds on which sides of closed surfaces points lie, by what the ray from each to +x crosses, exactly.
// Compiled without fused operations: posed points are those of the CPU.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

/// Counts what the ray from a point crosses of a body.
struct Crossings {
  const ProbedBody& body;
  const ProbedSurface& surface;
  const TriangleTopology* topology;
  double point[3];
  std::int32_t winding = 0;
  std::uint32_t count = 0;

  __device__ void take(std::uint32_t triangle) {
    if (surface.labels != nullptr && (surface.labels[triangle] & containment::kOfOpenComponent) != 0) return;
    double corner[3][3];
    corners_of(body, triangle, corner);
    const int crossing = containment::ray_crossing(corner, point);
    if (crossing == 0) return;
    ++count;
    winding += is_turned(topology[triangle].flags) ? -crossing : crossing;
  }
};

__device__ void count_crossings(Crossings& crossings, Counter& looked_at) {
  const double along[3] = {1, 0, 0};
  const ProbedBody& body = crossings.body;
  LocalRay local;
  const RayReach reach = local_ray(body.frame, world_ray(crossings.point, along, INFINITY), INFINITY, local);
  if (reach == RayReach::in_frame) {
    walk_ray(body, local, looked_at, [&](std::uint32_t triangle, float&) {
      crossings.take(triangle);
      return true;
    });
  } else if (reach == RayReach::out_of_range) {
    looked_at += probe::walk_world_boxes(
        body.pose, body.blocks, [&](const WorldBox& box) { return probe::may_cross(box, crossings.point); },
        [&](std::uint32_t triangle) {
          crossings.take(triangle);
          return true;
        });
  }
}

__device__ void find_sides_of(const PointArgs& args, std::uint32_t number, Counter& looked_at) {
  double point[3];
  for (int k = 0; k < 3; ++k) point[k] = args.asked.points[std::uint64_t{3} * number + k];
  std::int32_t winding = 0;
  std::uint32_t within = kNoIndex;
  const double limit = 0;
  visit_bodies(
      PlacesOfBodies{args},
      [&](const WorldBox& box) { return probe::distance_to(box, point) == 0 ? 0 : INFINITY; }, limit,
      [&](std::uint32_t body) {
        const std::uint32_t asset = args.bodies[body].asset;
        if (args.surfaces[asset].any_closed == 0) return;
        Crossings crossings = {args.bodies[body],
                               args.surfaces[asset],
                               args.assets[asset].tree.topology,
                               {point[0], point[1], point[2]}};
        count_crossings(crossings, looked_at);
        winding += crossings.winding;
        if (crossings.count % 2 != 0 && body < within) within = body;
      });
  args.rows[number].winding = winding;
  args.rows[number].within = within;
}

__global__ void __launch_bounds__(kThreads) find(const __grid_constant__ PointArgs args) {
  if (args.counts->error != 0) return;
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  Counter looked_at = 0;
  if (i < args.probe_count)
    find_sides_of(args, args.probe_numbers[std::uint64_t{args.probe_count} + i], looked_at);
  add_up(args.counts->blocks, looked_at);
}

}  // namespace

cudaError_t find_sides(const PointArgs& args, cudaStream_t stream) {
  if (!args.asked.sides || args.probe_count == 0 || args.instances.count == 0) return cudaSuccess;
  find<<<(args.probe_count - 1) / kThreads + 1, kThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
