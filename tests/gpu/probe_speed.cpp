// Measures closest points and rays of one body on a GPU: probe_speed FILE.bvh [COUNT]
// COUNT points lie at random places in a box twice as large as the mesh's, and as many rays go from there in
// random directions (10^6 where not given). Prints the median of 20 launches of a graph.
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "gpu/gpu_speed.h"
#include "tandem/kernels/gpu_probe_query.h"
#include "tandem/runtime/map.h"
#include "tandem/runtime/upload.h"

namespace tandem {
namespace {

constexpr int kLaunches = 20;

void print(const char* what, double milliseconds, std::uint32_t count, const GpuProbeReport& report) {
  std::printf(
      "%-24s %8.3f ms, %7.1f million a second; %u left by float64, %.1f blocks and %.2f triangles each\n",
      what, milliseconds, 1e-3 * count / milliseconds, report.exact,
      static_cast<double>(report.counters.blocks) / count,
      static_cast<double>(report.counters.by_float64) / count);
}

int run(const char* path, std::uint32_t count) {
  MappedAsset file;
  expect(file.open(path), path);
  const AssetView& view = file.view();
  DeviceAssets uploaded;
  expect(uploaded.upload({&view, 1}, Contents::all, nullptr), "upload");
  const GpuAsset asset = gpu_asset(uploaded.level(0), view);

  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal;
  std::vector<double> points, directions;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double lo = double{view.header->lower[k]}, hi = double{view.header->upper[k]};
      points.push_back(view.header->origin[k] + 0.5 * (lo + hi) + (hi - lo) * uniform(random));
      directions.push_back(normal(random));
    }
  }
  GpuArray<double> points_on_gpu, directions_on_gpu;
  GpuArray<std::uint32_t> number;
  GpuArray<Pose> pose;
  upload(points, points_on_gpu, "points");
  upload(directions, directions_on_gpu, "directions");
  upload(std::vector<std::uint32_t>{0}, number, "instance");
  upload(std::vector<Pose>{kIdentityPose}, pose, "pose");
  const GpuInstances instances = {number.data(), pose.data(), 1};

  GpuProbeQuery query;
  expect(query.set_assets({&asset, 1}, nullptr), "assets");
  GpuStream stream;
  expect(stream.create(), "stream");
  std::printf("%s: %u triangles; %u points and rays\n", path, asset.tree.triangle_count, count);
  for (const bool sides : {false, true}) {
    if (sides && asset.tree.topology == nullptr) continue;
    GpuClosestOptions options;
    options.points = points_on_gpu.data();
    options.point_count = count;
    options.sides = sides;
    expect(query.find(instances, options, nullptr), "closest points");
    const double time = median_of(kLaunches, stream.get(),
                                  [&](cudaStream_t on) { return query.enqueue(instances, options, on); });
    print(sides ? "closest points and sides" : "closest points", time, count, query.report());
  }
  for (const RayHits hits : {RayHits::first, RayHits::any, RayHits::all}) {
    GpuRayOptions options;
    options.origins = points_on_gpu.data();
    options.directions = directions_on_gpu.data();
    options.ray_count = count;
    options.hits = hits;
    expect(query.find(instances, options, nullptr), "rays");
    const double time = median_of(kLaunches, stream.get(),
                                  [&](cudaStream_t on) { return query.enqueue(instances, options, on); });
    print(hits == RayHits::first ? "first hits"
          : hits == RayHits::any ? "any hits"
                                 : "all hits",
          time, count, query.report());
  }
  return 0;
}

}  // namespace
}  // namespace tandem

int main(int count, char** arguments) {
  const int probes = count > 2 ? std::atoi(arguments[2]) : 1000000;
  if (count < 2 || count > 3 || probes < 1) {
    std::fprintf(stderr, "usage: probe_speed FILE.bvh [COUNT]\n");
    return 2;
  }
  return tandem::run(arguments[1], static_cast<std::uint32_t>(probes));
}
