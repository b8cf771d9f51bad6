#include <tandem/formats/gpu_memory.h>
#include <tandem/formats/gpu_status.h>
#include <tandem/formats/gpu_stream.h>
#include <tandem/kernels/gpu_impact_query.h>
#include <tandem/runtime/map.h>
#include <tandem/runtime/upload.h>
#include <cstdio>

constexpr std::uint32_t kBodies = 200;
constexpr double kStep = 1.0 / 60;

// Two sheets of a hundred bodies, shot at each other so fast that they would change places in a step.
__global__ void place_bodies(std::uint32_t* asset, tandem::Pose* pose, tandem::RigidMotion* motion,
                             double size) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= kBodies) return;
  const double side = i < kBodies / 2 ? -1 : 1;
  asset[i] = 0;
  pose[i] = tandem::kIdentityPose;
  pose[i].translation[0] = 2 * size * (i % 10);
  pose[i].translation[1] = 2 * size * (i / 10 % 10);
  pose[i].translation[2] = 5 * size * side;
  motion[i] = {{0, 0, -10 * size * side / kStep}, {0, side * i, 0}, {}};
  for (int k = 0; k < 3; ++k) motion[i].centre[k] = pose[i].translation[k];
}

// Carries bodies to where they meet the first other one, or to the end of the step: one thread for all.
__global__ void move_bodies(tandem::Pose* pose, const tandem::RigidMotion* motion,
                            const tandem::ObjectPair* pairs, const tandem::Impact* impacts,
                            const tandem::GpuImpactReport* report) {
  double until[kBodies];
  for (std::uint32_t i = 0; i < kBodies; ++i) until[i] = kStep;
  for (std::uint32_t i = 0; i < report->impacts; ++i) {
    for (const std::uint32_t body : {pairs[i].a, pairs[i].b})
      until[body] = fmin(until[body], impacts[i].t_safe);
  }
  for (std::uint32_t i = 0; i < kBodies; ++i) pose[i] = tandem::pose_at(pose[i], motion[i], until[i]);
}

int fail(const char* what, tandem::Status status, cudaError_t error) {
  std::printf("%s: %s (%s)\n", what, tandem::explain(status), cudaGetErrorString(error));
  return 1;
}

int main(int argc, char** argv) {
  const char* path = argc > 1 ? argv[1] : "cow.bvh";
  tandem::MappedAsset file;
  tandem::Status status = file.open(path);
  if (status != tandem::Status::kOk) return fail(path, status, cudaSuccess);
  tandem::GpuStream owner;
  if (const cudaError_t error = owner.create(); error != cudaSuccess)
    return fail("a stream", tandem::status_of(error), error);
  const cudaStream_t stream = owner.get();
  tandem::DeviceAssets cow;
  status = cow.upload({&file.view(), 1}, tandem::Contents::all, stream);
  if (status != tandem::Status::kOk) return fail("upload", status, cow.cuda_error());
  const tandem::GpuAsset asset = tandem::gpu_asset(cow.level(0), file.view());

  tandem::GpuArray<std::uint32_t> asset_of_body;
  tandem::GpuArray<tandem::Pose> poses;
  tandem::GpuArray<tandem::RigidMotion> motion;
  for (const cudaError_t error :
       {asset_of_body.reserve(kBodies), poses.reserve(kBodies), motion.reserve(kBodies)}) {
    if (error != cudaSuccess) return fail("bodies", tandem::status_of(error), error);
  }
  const double size = file.view().header->upper[0] - file.view().header->lower[0];
  place_bodies<<<1, kBodies, 0, stream>>>(asset_of_body.data(), poses.data(), motion.data(), size);

  tandem::GpuImpactQuery query;
  status = query.set_assets({&asset, 1}, stream);
  if (status != tandem::Status::kOk) return fail("assets", status, query.cuda_error());
  const tandem::GpuInstances bodies = {asset_of_body.data(), poses.data(), kBodies};
  // find() makes room and waits; a simulation reserves room once, and calls enqueue(), which does neither.
  status = query.find(bodies, motion.data(), kStep, {.sorted = true}, stream);
  if (status != tandem::Status::kOk) return fail("impacts", status, query.cuda_error());
  move_bodies<<<1, 1, 0, stream>>>(poses.data(), motion.data(), query.pairs().pairs, query.impacts(),
                                   query.device_report());
  if (const cudaError_t error = cudaStreamSynchronize(stream); error != cudaSuccess)
    return fail("a step", tandem::status_of(error), error);
  const tandem::ImpactCounters& counters = query.report().counters;
  std::printf("%llu pairs of bodies, %llu meet in the step\n",
              static_cast<unsigned long long>(counters.object_pairs),
              static_cast<unsigned long long>(counters.found));
}
