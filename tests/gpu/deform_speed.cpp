// Measures bodies that deform on a GPU beside the same ones at rest: deform_speed FILE.bvh [BODIES [SPACING]]
// All bodies are of the file's mesh, each twisted in its own way; they stand in a square grid along x and y,
// SPACING of the mesh's width apart (1000 bodies and 0.9 where not given). Prints the median of 100 launches
// of a graph.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "gpu/gpu_speed.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/gpu_deformer.h"
#include "tandem/runtime/map.h"
#include "tandem/runtime/upload.h"

namespace tandem {
namespace {

constexpr int kLaunches = 100;

/// The positions of the source vertices at rest, in the file's coordinates. Those that no triangle has are at
/// the origin of the file.
std::vector<float> positions_of(const AssetView& asset) {
  const LevelView level = asset.level();
  std::vector<float> out(3 * asset.header->source_vertices);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(asset.header->origin[i % 3]);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    for (int c = 0; c < 3; ++c) {
      const std::size_t v = level.source_vertices[level.topology[t].vertex[c]];
      for (std::size_t k = 0; k < 3; ++k)
        out[3 * v + k] =
            static_cast<float>(asset.header->origin[k] + double{level.triangles[t].corner[c].position[k]});
    }
  }
  return out;
}

/// Turns each vertex about the vertical line through the middle, the more the higher it lies.
void twist(std::vector<float>& positions, const AssetView& asset, double amount) {
  const FileHeader& file = *asset.header;
  const double height = double{file.upper[2]} - double{file.lower[2]};
  double middle[3];
  for (int k = 0; k < 3; ++k)
    middle[k] = file.origin[k] + 0.5 * (double{file.upper[k]} + double{file.lower[k]});
  for (std::size_t i = 0; i < positions.size(); i += 3) {
    const double angle = amount * (double{positions[i + 2]} - middle[2]) / height, c = std::cos(angle),
                 s = std::sin(angle), x = double{positions[i]} - middle[0],
                 y = double{positions[i + 1]} - middle[1];
    positions[i] = static_cast<float>(middle[0] + c * x - s * y);
    positions[i + 1] = static_cast<float>(middle[1] + s * x + c * y);
  }
}

/// A step of bodies whose records and bounds are these.
struct Step {
  GpuInstances instances;
  GpuAssetBounds bounds;
  GpuBroadPhase broad_phase;
  GpuContactQuery query;

  void prepare(std::span<const GpuAsset> assets, const GpuAssetRecords& records) {
    expect(query.set_assets(assets, nullptr), "assets");
    expect(query.follow(records), "follow");
    expect(broad_phase.find_pairs(instances, bounds, {}, nullptr), "broad phase");
    expect(query.find_contacts(instances, broad_phase.pairs(), {}, nullptr), "contacts");
  }
  Status enqueue(cudaStream_t stream) {
    const Status status = broad_phase.enqueue(instances, bounds, {}, stream);
    return status == Status::kOk ? query.enqueue(instances, broad_phase.pairs(), {}, stream) : status;
  }
  void print(const char* what, double milliseconds) const {
    std::printf("%-28s %8.3f ms, %llu pairs, %llu contacts, %llu block pairs\n", what, milliseconds,
                static_cast<unsigned long long>(broad_phase.report().found),
                static_cast<unsigned long long>(query.report().contacts),
                static_cast<unsigned long long>(query.report().counters.block_pairs));
  }
};

int run(const char* path, std::uint32_t bodies, double spacing) {
  MappedAsset file;
  expect(file.open(path), path);
  const AssetView& view = file.view();
  DeviceAssets uploaded;
  expect(uploaded.upload({&view, 1}, Contents::all, nullptr), "upload");
  const std::vector<GpuAsset> assets(bodies, gpu_asset(uploaded.level(0), view));
  if (assets[0].tree.source_vertices == nullptr) expect(Status::kNoSourceVertices, path);

  const std::vector<float> rest = positions_of(view);
  std::vector<std::uint32_t> numbers(bodies);
  std::vector<Pose> poses(bodies);
  std::vector<const float*> places(bodies);
  GpuArray<float> positions;
  std::vector<float> all;
  const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(double(bodies))));
  for (std::uint32_t i = 0; i < bodies; ++i) {
    numbers[i] = i;
    poses[i] = kIdentityPose;
    const std::uint32_t at[2] = {i % side, i / side};
    for (int k = 0; k < 2; ++k)
      poses[i].translation[k] =
          spacing * at[k] * (double{view.header->upper[k]} - double{view.header->lower[k]});
    std::vector<float> own = rest;
    twist(own, view, std::sin(0.7 * i));
    all.insert(all.end(), own.begin(), own.end());
  }
  upload(all, positions, "positions");
  for (std::uint32_t i = 0; i < bodies; ++i) places[i] = positions.data() + i * rest.size();
  GpuArray<const float*> places_on_gpu;
  GpuArray<std::uint32_t> asset;
  GpuArray<Pose> pose;
  upload(places, places_on_gpu, "places");
  upload(numbers, asset, "instances");
  upload(poses, pose, "poses");

  GpuAssetList list, rigid_list;
  GpuDeformer deformer;
  expect(list.set(assets, PositionTypes::float32, nullptr), "list");
  expect(rigid_list.set(assets, PositionTypes::float32, nullptr), "list");
  expect(deformer.begin(assets, numbers, list.records(), nullptr), "deformer");
  expect(deformer.deform({.in_float32 = places_on_gpu.data()}, nullptr), "deform");
  const GpuInstances instances = {asset.data(), pose.data(), bodies};
  Step bent = {instances, list.records().bounds_of_all(), {}, {}};
  Step rigid = {instances, rigid_list.records().bounds_of_all(), {}, {}};
  bent.prepare(assets, list.records());
  rigid.prepare(assets, {});

  GpuStream stream;
  expect(stream.create(), "stream");
  expect(cudaDeviceSynchronize(), "wait");
  const auto refit = [&](cudaStream_t on) {
    return deformer.enqueue({.in_float32 = places_on_gpu.data()}, on);
  };
  std::printf("%u bodies of %u triangles, %u blocks, %zu vertices; %.2f GB of trees\n", bodies,
              view.level().triangle_count, view.level().block_count, rest.size() / 3,
              1e-9 * static_cast<double>(deformer.bytes()));
  const double refit_ms = median_of(kLaunches, stream.get(), refit);
  const double bytes =
      bodies * (view.level().triangle_count * (48.0 + 12) + view.level().block_count * (128.0 + 112) +
                4.0 * static_cast<double>(rest.size()));
  std::printf("%-28s %8.3f ms, %.0f GB/s of triangles, blocks and positions\n", "refit", refit_ms,
              1e-6 * bytes / refit_ms);
  bent.print("deformed: pairs, contacts",
             median_of(kLaunches, stream.get(), [&](cudaStream_t on) { return bent.enqueue(on); }));
  bent.print("refit, pairs, contacts", median_of(kLaunches, stream.get(), [&](cudaStream_t on) {
               const Status status = refit(on);
               return status == Status::kOk ? bent.enqueue(on) : status;
             }));
  rigid.print("at rest: pairs, contacts",
              median_of(kLaunches, stream.get(), [&](cudaStream_t on) { return rigid.enqueue(on); }));
  expect(deformer.report().status, "report");
  expect(bent.query.report().status, "report");
  expect(rigid.query.report().status, "report");
  return bent.query.report().complete != 0 && rigid.query.report().complete != 0 ? 0 : 1;
}

}  // namespace
}  // namespace tandem

int main(int count, char** arguments) {
  const int bodies = count > 2 ? std::atoi(arguments[2]) : 1000;
  if (count < 2 || count > 4 || bodies < 1) {
    std::fprintf(stderr, "usage: deform_speed FILE.bvh [BODIES [SPACING]]\n");
    return 2;
  }
  return tandem::run(arguments[1], static_cast<std::uint32_t>(bodies),
                     count > 3 ? std::atof(arguments[3]) : 0.9);
}
