#include <tandem/formats/gpu_memory.h>
#include <tandem/formats/gpu_status.h>
#include <tandem/formats/gpu_stream.h>
#include <tandem/kernels/gpu_broad_phase.h>
#include <tandem/kernels/gpu_contact_query.h>
#include <tandem/runtime/map.h>
#include <tandem/runtime/upload.h>
#include <cstdio>
#include <vector>

constexpr std::uint32_t kBodies = 1000;
constexpr int kSteps = 60;

// The simulation: ten floors of a hundred bodies fall, the lower ones first to rest, and turn all the time.
__global__ void move_bodies(tandem::Pose* pose, double size, int step) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= kBodies) return;
  const double time = step / 60.0, floor = i / 100;
  const double height = fmax(0.4 * size * floor, 2 * size * (floor + 1) - 40 * size * time * time);
  const double angle = i + (1 + i % 7) * time, c = cos(angle), s = sin(angle);
  pose[i] = {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}, {size * (i % 10), size * (i / 10 % 10), height}};
}

int fail(const char* what, tandem::Status status, cudaError_t error) {
  std::printf("%s: %s (%s)\n", what, tandem::explain(status), cudaGetErrorString(error));
  return 1;
}

int main(int argc, char** argv) {
  const char* path = argc > 1 ? argv[1] : "cow.bvh";
  tandem::MappedAsset file;
  if (const tandem::Status status = file.open(path); status != tandem::Status::kOk)
    return fail(path, status, cudaSuccess);
  tandem::GpuStream owner;
  if (const cudaError_t error = owner.create(); error != cudaSuccess)
    return fail("a stream", tandem::status_of(error), error);
  const cudaStream_t stream = owner.get();
  tandem::DeviceAssets cow;  // one allocation for all assets, here one
  tandem::Status status = cow.upload({&file.view(), 1}, tandem::Contents::exact_queries, stream);
  if (status != tandem::Status::kOk) return fail("upload", status, cow.cuda_error());

  // The scene, all of it in GPU memory: the asset's bounds, and for each body the asset and a pose.
  const tandem::FileHeader& header = *file.view().header;
  const tandem::GpuAsset asset = tandem::gpu_asset(cow.level(0), file.view());
  const tandem::AssetBounds bounds = tandem::asset_bounds(header);
  tandem::GpuArray<tandem::AssetBounds> gpu_bounds;
  tandem::GpuArray<std::uint32_t> asset_of_body;
  tandem::GpuArray<tandem::Pose> poses;
  tandem::GpuArray<tandem::GpuContactReport> history;
  for (const cudaError_t error : {gpu_bounds.upload({&bounds, 1}, stream), asset_of_body.reserve(kBodies),
                                  poses.reserve(kBodies), history.reserve(kSteps)}) {
    if (error != cudaSuccess) return fail("scene", tandem::status_of(error), error);
  }
  cudaMemsetAsync(asset_of_body.data(), 0, asset_of_body.bytes(), stream);
  const tandem::GpuInstances bodies = {asset_of_body.data(), poses.data(), kBodies};

  // Room for as much as the scene may need.
  tandem::GpuBroadPhase broad;
  status = broad.reserve({.boxes = kBodies, .pairs = 32 * kBodies, .instances = kBodies});
  if (status != tandem::Status::kOk) return fail("broad phase", status, broad.cuda_error());
  tandem::GpuContactQuery query;
  status = query.set_assets({&asset, 1}, stream);
  if (status == tandem::Status::kOk)
    status = query.reserve({.pairs = 32 * kBodies, .contacts = 4'000'000, .undecided = 400'000});
  if (status != tandem::Status::kOk) return fail("contacts", status, query.cuda_error());

  // All steps are queued at once, and nothing waits for the GPU.
  const double size = header.upper[0] - header.lower[0];
  for (int step = 0; step < kSteps; ++step) {
    move_bodies<<<(kBodies + 255) / 256, 256, 0, stream>>>(poses.data(), size, step);
    status = broad.enqueue(bodies, {gpu_bounds.data(), 1}, {}, stream);
    if (status != tandem::Status::kOk) return fail("broad phase", status, broad.cuda_error());
    status = query.enqueue(bodies, broad.pairs(), {}, stream);
    if (status != tandem::Status::kOk) return fail("contacts", status, query.cuda_error());
    // A solver goes on here, on the same stream: query.contacts(), and device_report() for their number.
    cudaMemcpyAsync(history.data() + step, query.device_report(), sizeof *history, cudaMemcpyDeviceToDevice,
                    stream);
  }

  std::vector<tandem::GpuContactReport> reports(kSteps);
  if (const cudaError_t error = tandem::download<tandem::GpuContactReport>(history.data(), reports, stream);
      error != cudaSuccess)
    return fail("steps", tandem::status_of(error), error);
  for (int step = 0; step < kSteps; ++step) {
    const tandem::GpuContactReport& report = reports[step];
    if (report.status != tandem::Status::kOk) {
      std::printf("step %d: body %d: ", step, static_cast<int>(report.where));
      return fail("contacts", report.status, cudaSuccess);
    }
    if (step % 10 == 9 || report.complete == 0) {
      std::printf("step %2d: %5llu pairs of bodies, %6llu of triangles%s\n", step,
                  static_cast<unsigned long long>(report.counters.object_pairs),
                  static_cast<unsigned long long>(report.contacts),
                  report.complete ? "" : ": not all, too little room");
    }
  }
}
