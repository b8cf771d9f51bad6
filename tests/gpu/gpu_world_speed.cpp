// Measures a world on a GPU: gpu_world_speed FLOOR.bvh BODY.bvh BODIES STEPS [EVERY [FILE]]
// The bodies fall on the floor, whose upper side is z = 0, from a grid above it, each turned in its own way.
// Prints, for each EVERY steps, the milliseconds of a step, contacts, speeds and heights, as CSV; FILE gets
// the state of all bodies at each of these times, as float64.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "tandem/dynamics/gpu_world.h"
#include "tandem/runtime/map.h"

namespace tandem {
namespace {

double size_of(const AssetView& asset) {
  double sum = 0;
  for (int k = 0; k < 3; ++k)
    sum += std::pow(double{asset.header->upper[k]} - double{asset.header->lower[k]}, 2);
  return std::sqrt(sum);
}

Pose turned(double angle, double x, double y, double z) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {{{c, -s * c, s * s}, {s, c * c, -s * c}, {0, s, c}}, {x, y, z}};
}

int fail(Status status, const char* what) {
  std::fprintf(stderr, "gpu_world_speed: %s: %s\n", what, explain(status));
  return 1;
}

int run(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr, "usage: gpu_world_speed FLOOR.bvh BODY.bvh BODIES STEPS [EVERY [FILE]]\n");
    return 2;
  }
  const int bodies = std::atoi(argv[3]), steps = std::atoi(argv[4]),
            every = argc > 5 ? std::atoi(argv[5]) : 60;
  MappedAsset files[2];
  std::vector<AssetView> assets;
  for (int i = 0; i < 2; ++i) {
    if (const Status status = files[i].open(argv[1 + i]); status != Status::kOk)
      return fail(status, argv[1 + i]);
    assets.push_back(files[i].view());
  }
  const double gap = 0.75 * size_of(assets[1]);
  const int side = std::max(1, static_cast<int>(std::ceil(std::sqrt(bodies / 20.0))));
  std::vector<BodyDescription> all(1);
  all[0].filter.motion = Motion::fixed;
  for (int i = 0; i < bodies; ++i) {
    BodyDescription& body = all.emplace_back();
    body.asset = 1;
    const int x = i % side, y = i / side % side, z = i / (side * side);
    body.pose = turned(0.7 * i, gap * (x - 0.5 * side), gap * (y - 0.5 * side), gap * (1 + z));
  }
  GpuWorld world;
  if (const Status status = world.set_assets(assets); status != Status::kOk) return fail(status, "assets");
  if (const Status status = world.set_bodies(all); status != Status::kOk) return fail(status, "bodies");
  std::FILE* const out = argc > 6 ? std::fopen(argv[6], "wb") : nullptr;
  std::printf("bodies,time,ms_per_step,slowest_ms,contacts,fastest,mean_speed,mean_height,asleep\n");
  for (int step = 0; step < steps; step += every) {
    double sum = 0, slowest = 0;
    for (int i = 0; i < every; ++i) {
      const auto begin = std::chrono::steady_clock::now();
      const Status status = world.step(1.0 / 60);
      const double ms =
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
      if (status != Status::kOk) return fail(status, "step");
      sum += ms, slowest = std::max(slowest, ms);
    }
    std::span<const BodyMotion> motions;
    std::span<const WorldContact> contacts;
    if (world.bodies(motions) != Status::kOk || world.contacts(contacts) != Status::kOk)
      return fail(Status::kCudaFailed, "copy");
    double fastest = 0, speed = 0, height = 0;
    int asleep = 0;
    for (const BodyMotion& body : motions.subspan(1)) {
      const double v = std::sqrt(body.velocity[0] * body.velocity[0] + body.velocity[1] * body.velocity[1] +
                                 body.velocity[2] * body.velocity[2]);
      fastest = std::max(fastest, v), speed += v / bodies, height += body.centre[2] / bodies;
      asleep += body.sleeps ? 1 : 0;
    }
    std::printf("%d,%.3f,%.4f,%.3f,%zu,%.4f,%.5f,%.4f,%d\n", bodies, world.time(), sum / every, slowest,
                contacts.size(), fastest, speed, height, asleep);
    std::fflush(stdout);
    for (const BodyMotion& body : motions) {
      if (out != nullptr) std::fwrite(&body.pose, sizeof body.pose, 1, out);
    }
  }
  if (out != nullptr) std::fclose(out);
  return 0;
}

}  // namespace
}  // namespace tandem

int main(int argc, char** argv) {
  return tandem::run(argc, argv);
}
