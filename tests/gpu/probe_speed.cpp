// Measures closest points and rays of one body on a GPU: probe_speed FILE.bvh [COUNT]
// COUNT points lie at random places in a box twice as large as the mesh's, and as many rays go from there in
// random directions (10^6 where not given). Prints the median of 20 launches of a graph.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "tandem/formats/gpu_stream.h"
#include "tandem/kernels/gpu_closest_query.h"
#include "tandem/kernels/gpu_ray_query.h"
#include "tandem/runtime/map.h"
#include "tandem/runtime/upload.h"

namespace tandem {
namespace {

constexpr int kLaunches = 20;

void expect(Status status, const char* what) {
  if (status == Status::kOk) return;
  std::fprintf(stderr, "probe_speed: %s: %s\n", what, name(status));
  std::exit(status == Status::kNoGpu ? 77 : 1);
}
void expect(cudaError_t error, const char* what) {
  if (error == cudaSuccess) return;
  std::fprintf(stderr, "probe_speed: %s: %s\n", what, cudaGetErrorString(error));
  std::exit(1);
}

template <typename Element>
void upload(const std::vector<Element>& from, GpuArray<Element>& to, const char* what) {
  expect(to.upload(from, nullptr), what);
  expect(cudaStreamSynchronize(nullptr), what);
}

/// The median time of a graph's launches, in ms. enqueue(stream): a Status.
template <typename Enqueue>
double median_of(cudaStream_t stream, const Enqueue& enqueue) {
  GpuGraph graph;
  expect(graph.capture(stream, [&] { expect(enqueue(stream), "enqueue"); }), "capture");
  GpuEvent begin, end;
  expect(begin.create(), "event");
  expect(end.create(), "event");
  std::vector<float> times;
  for (int i = 0; i < kLaunches + 2; ++i) {
    expect(begin.record(stream), "record");
    expect(graph.launch(stream), "launch");
    expect(end.record(stream), "record");
    expect(end.wait(), "wait");
    float milliseconds = 0;
    expect(milliseconds_between(begin, end, milliseconds), "time");
    if (i >= 2) times.push_back(milliseconds);
  }
  std::nth_element(times.begin(), times.begin() + kLaunches / 2, times.end());
  return double{times[kLaunches / 2]};
}

template <typename Report>
void print(const char* what, double milliseconds, std::uint32_t count, const Report& report) {
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

  GpuClosestQuery closest;
  GpuRayQuery rays;
  expect(closest.set_assets({&asset, 1}, nullptr), "assets");
  expect(rays.set_assets({&asset, 1}, nullptr), "assets");
  GpuStream stream;
  expect(stream.create(), "stream");
  std::printf("%s: %u triangles; %u points and rays\n", path, asset.tree.triangle_count, count);
  for (const bool sides : {false, true}) {
    if (sides && asset.tree.topology == nullptr) continue;
    GpuClosestOptions options;
    options.points = points_on_gpu.data();
    options.point_count = count;
    options.sides = sides;
    expect(closest.find(instances, options, nullptr), "closest points");
    const double time =
        median_of(stream.get(), [&](cudaStream_t on) { return closest.enqueue(instances, options, on); });
    print(sides ? "closest points and sides" : "closest points", time, count, closest.report());
  }
  for (const RayHits hits : {RayHits::first, RayHits::any, RayHits::all}) {
    GpuRayOptions options;
    options.origins = points_on_gpu.data();
    options.directions = directions_on_gpu.data();
    options.ray_count = count;
    options.hits = hits;
    expect(rays.find(instances, options, nullptr), "rays");
    const double time =
        median_of(stream.get(), [&](cudaStream_t on) { return rays.enqueue(instances, options, on); });
    print(hits == RayHits::first ? "first hits"
          : hits == RayHits::any ? "any hits"
                                 : "all hits",
          time, count, rays.report());
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
