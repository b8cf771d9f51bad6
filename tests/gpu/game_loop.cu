#include <tandem/formats/gpu_memory.h>
#include <tandem/formats/gpu_status.h>
#include <tandem/formats/gpu_stream.h>
#include <tandem/kernels/gpu_broad_phase.h>
#include <tandem/kernels/gpu_contact_manifolds.h>
#include <tandem/runtime/map.h>
#include <tandem/runtime/upload.h>
#include <cstdio>
#include <cstdlib>
#include <vector>
#include "game_solver.cuh"

// Cubes fall on a floor of fixed ones, tumble and come to rest. The CPU queues all steps and looks at none.
constexpr std::uint32_t kRoom = 1 << 14, kSteps = 480;

void must(Status status) {
  if (status != Status::kOk) std::printf("%s\n", explain(status)), std::exit(1);
}

int main(int, char** argv) {
  MappedAsset cube;
  GpuStream owner;
  DeviceAssets uploaded;
  GpuBroadPhase broad;
  GpuContactQuery query;
  GpuContactManifolds manifolds;
  GpuArray<AssetBounds> gpu_bounds;
  GpuArray<std::uint32_t> assets;
  GpuArray<Pose> poses;
  GpuArray<Motion> motion;
  GpuArray<Body> bodies;
  GpuArray<Touch> touches[2];  // of this step and of the one before, by turns
  GpuArray<Step> history;
  must(cube.open(argv[1])), must(status_of(owner.create()));
  const cudaStream_t stream = owner.get();
  must(uploaded.upload({&cube.view(), 1}, Contents::manifolds, stream));
  const GpuAsset asset = gpu_asset(uploaded.level(0), cube.view());
  const AssetBounds bounds = asset_bounds(*cube.view().header);
  std::vector<Pose> pose(kBodies, kIdentityPose);
  std::vector<Body> body(kBodies);
  std::vector<Motion> who(kBodies, Motion::fixed);
  const std::vector<std::uint32_t> cubes(kBodies);
  std::vector<Step> steps(kSteps);
  for (int i = 0, k = -int{kFloor}; i < int{kBodies}; ++i, ++k) {
    double(&x)[3] = pose[i].translation;
    x[0] = k < 0 ? i % 9 - 4 : 1.1 * (k % 3) - 1.1 + 0.02 * (k % 7);
    x[1] = k < 0 ? i / 9 - 4 : 1.1 * (k / 3 % 3) - 1.1 + 0.03 * (k % 5);
    x[2] = k < 0 ? -0.5 : 0.6 + 1.2 * (k / 9);
    if (k >= 0) who[i] = Motion::moving, body[i].spin = {k % 5 - 2.0, k % 3 - 1.0, 0};
  }
  for (const cudaError_t error :
       {gpu_bounds.upload({&bounds, 1}, stream), poses.upload(pose, stream), motion.upload(who, stream),
        bodies.upload(body, stream), assets.upload(cubes, stream), touches[0].reserve(kRoom),
        touches[1].reserve(kRoom), history.upload(steps, stream)})
    must(status_of(error));
  const GpuBroadPhaseOptions filtered = {.sorted = true, .filter = {.motion = motion.data()}};
  must(broad.reserve({.boxes = kBodies, .pairs = kRoom, .instances = kBodies}, filtered));
  must(query.set_assets({&asset, 1}, stream)), must(manifolds.set_assets({&asset, 1}, stream));
  must(query.reserve({.pairs = kRoom, .contacts = kRoom, .undecided = kRoom}, {.grouped = true}));
  must(manifolds.reserve({.pairs = kRoom, .contacts = kRoom, .manifolds = kRoom, .points = kRoom}));
  const GpuInstances scene = {assets.data(), poses.data(), kBodies};
  for (int step = 0; step < kSteps; ++step) {  // all are queued at once
    must(broad.enqueue(scene, {gpu_bounds.data(), 1}, filtered, stream));
    must(query.enqueue(scene, broad.pairs(), {.grouped = true}, stream));
    must(manifolds.enqueue(scene, broad.pairs(), query, {}, stream));
    solve<<<1, kThreads, 0, stream>>>(poses.data(), motion.data(), bodies.data(), touches[step % 2].data(),
                                      touches[1 - step % 2].data(), history.data() + step,
                                      broad.pairs().pairs, manifolds.manifolds(), manifolds.points(),
                                      manifolds.device_report());
    must(status_of(cudaGetLastError()));
  }
  must(status_of(download<Step>(history.data(), steps, stream)));
  for (int step = 1; step <= kSteps; ++step) {
    const Step& told = steps[step - 1];
    if (told.complete == 0) return std::printf("step %d: too little room\n", step), 1;
    if (step % 60 == 0)
      std::printf("%d s: %u points, %.1f mm deep\n", step / 60, told.points, 1e-3 * told.deepest);
    if (told.asleep == kBodies - kFloor) return std::printf("all are asleep after %d steps\n", step), 0;
  }
  return std::puts("the cubes do not come to rest"), 1;
}
