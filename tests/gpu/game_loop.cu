#include <tandem/formats/gpu_status.h>
#include <tandem/kernels/gpu_broad_phase.h>
#include <tandem/kernels/gpu_manifold_query.h>
#include <tandem/kernels/motion.h>
#include <tandem/runtime/map.h>
#include <tandem/runtime/upload.h>
#include <cstdio>
#include <cstdlib>

using namespace tandem;
using Vec = manifold::Vector3;

// Cubes of side 1 and mass 1 fall on a floor of fixed ones, tumble and come to rest. The CPU only queues.
constexpr std::uint32_t kFloor = 121, kBodies = kFloor + 36, kRoom = 4096;
constexpr int kRate = 960, kSteps = 8 * kRate;  // short steps instead of sweeps of a solver
constexpr double kStep = 1.0 / kRate, kFriction = 0.6, kSlow = 0.05;
constexpr double kStiffness = 2e4, kDamping = 200;  // of a square metre; more needs shorter steps
__managed__ Pose poses[kBodies];
__managed__ RigidMotion moves[kBodies];  // about the middles of the cubes
__managed__ Motion motion[kBodies];
__managed__ std::uint32_t assets[kBodies], calm_steps[kBodies];  // assets: all 0, the cube
__managed__ unsigned long long pushes[kBodies][6];               // impulse and its moment, in units of 2^-40
__managed__ AssetBounds bounds;
__managed__ std::uint32_t complete[kSteps], count[kSteps], depth[kSteps], asleep[kSteps];

__device__ Vec of(const double (&p)[3]) {
  return {p[0], p[1], p[2]};
}

// Sums of whole numbers do not depend on their order, so that every run has the same bytes.
__device__ void push(std::uint32_t body, Vec arm, Vec p) {
  const Vec turn = cross(arm, p);
  const double sums[6] = {p.x, p.y, p.z, turn.x, turn.y, turn.z};
  for (int k = 0; k < 6; ++k) atomicAdd(&pushes[body][k], llrint(0x1p40 * sums[k]));
}

__global__ void push_bodies(int step, const ObjectPair* pairs, const Manifold* manifolds,
                            const ManifoldPoint* points, const GpuManifoldReport* report) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i == 0) complete[step] = report->complete, count[step] = report->points;
  if (i >= report->points) return;
  const ManifoldPoint& point = points[i];
  const Manifold& m = manifolds[point.manifold];
  const auto [a, b] = pairs[m.pair];
  const Vec n = of(point.normal), x = of(point.position);
  const Vec arm_a = x - of(poses[a].translation), arm_b = x - of(poses[b].translation);
  const Vec speed_a = of(moves[a].velocity) + cross(of(moves[a].angular_velocity), arm_a);
  const Vec speed_b = of(moves[b].velocity) + cross(of(moves[b].angular_velocity), arm_b);
  const Vec speed = speed_b - speed_a, slide = speed - dot(speed, n) * n;
  const double share = kStep * norm(of(m.area_vector)) / m.point_count;  // of the area, for a step
  const double along = fmax(0.0, share * (kStiffness * point.depth - kDamping * dot(speed, n)));
  const double drag = fmin(share * kDamping, kFriction * along / fmax(norm(slide), 1e-9));
  push(a, arm_a, drag * slide - along * n), push(b, arm_b, along * n - drag * slide);
  for (const std::uint32_t k : {a, b})  // who is hit wakes
    if (motion[k] == Motion::sleeping && norm(speed) > 4 * kSlow) motion[k] = Motion::moving;
  atomicMax(&depth[step], static_cast<std::uint32_t>(1e6 * point.depth));
}

__global__ void move_bodies(int step) {
  const std::uint32_t i = threadIdx.x;
  RigidMotion& move = moves[i];
  if (motion[i] == Motion::fixed) return;
  for (int k = 0; k < 3; ++k) {  // the inertia of a cube is a sixth of its mass about every axis
    move.velocity[k] += 0x1p-40 * static_cast<long long>(pushes[i][k]) - (k == 2 ? 9.81 * kStep : 0);
    move.angular_velocity[k] += 6 * 0x1p-40 * static_cast<long long>(pushes[i][3 + k]);
    move.centre[k] = poses[i].translation[k], pushes[i][k] = pushes[i][3 + k] = 0;
  }
  const double speed = norm(of(move.velocity)) + norm(of(move.angular_velocity));
  calm_steps[i] = speed < kSlow ? calm_steps[i] + 1 : 0;
  if (calm_steps[i] >= kRate / 2) motion[i] = Motion::sleeping;
  if (motion[i] == Motion::moving) poses[i] = pose_at(poses[i], move, kStep);
  if (motion[i] == Motion::sleeping) move = kAtRest, atomicAdd(&asleep[step], 1);
}

void must(Status status) {
  if (status != Status::kOk) std::printf("%s\n", explain(status)), std::exit(1);
}

int main(int, char** argv) {
  const cudaStream_t stream = cudaStreamPerThread;
  MappedAsset cube;
  DeviceAssets uploaded;
  GpuBroadPhase broad;
  GpuContactQuery query;
  GpuManifoldQuery manifolds;
  must(cube.open(argv[1])), must(uploaded.upload({&cube.view(), 1}, Contents::manifolds, stream));
  const GpuAsset asset = gpu_asset(uploaded.level(0), cube.view());
  bounds = asset_bounds(*cube.view().header);
  for (int i = 0, k = -int{kFloor}; i < int{kBodies}; ++i, ++k) {
    double(&x)[3] = (poses[i] = kIdentityPose).translation;
    x[0] = k < 0 ? i % 11 - 5 : 1.1 * (k % 3) - 1.1 + 0.02 * (k % 7);
    x[1] = k < 0 ? i / 11 - 5 : 1.1 * (k / 3 % 3) - 1.1 + 0.03 * (k % 5);
    x[2] = k < 0 ? -0.5 : 0.6 + 1.2 * (k / 9);
    motion[i] = k < 0 ? Motion::fixed : Motion::moving;
    if (k >= 0) moves[i] = {{0, 0, 0}, {k % 5 - 2.0, k % 3 - 1.0, 0}};
  }
  const GpuBroadPhaseOptions filtered = {.filter = {.motion = motion}};
  must(broad.reserve({.boxes = kBodies, .pairs = kRoom, .instances = kBodies}, filtered));
  must(query.set_assets({&asset, 1}, stream)), must(manifolds.set_assets({&asset, 1}, stream));
  must(query.reserve({.pairs = kRoom, .contacts = kRoom, .undecided = kRoom}, {.grouped = true}));
  must(manifolds.reserve({.pairs = kRoom, .contacts = kRoom, .manifolds = kRoom, .points = kRoom}));
  const GpuInstances scene = {assets, poses, kBodies};
  for (int step = 0; step < kSteps; ++step) {
    must(broad.enqueue(scene, {&bounds, 1}, filtered, stream));
    must(query.enqueue(scene, broad.pairs(), {.grouped = true}, stream));
    must(manifolds.enqueue(scene, broad.pairs(), query, {}, stream));
    push_bodies<<<kRoom / 128, 128, 0, stream>>>(step, broad.pairs().pairs, manifolds.manifolds(),
                                                 manifolds.points(), manifolds.device_report());
    move_bodies<<<1, kBodies, 0, stream>>>(step);
    must(status_of(cudaGetLastError()));
  }
  must(status_of(cudaStreamSynchronize(stream)));
  for (int i = 0; i < kSteps; ++i) {
    if (complete[i] == 0) return std::printf("step %d: too little room\n", i), 1;
    if (i % kRate == 0) std::printf("%d s: %u points, %.1f mm deep\n", i / kRate, count[i], 1e-3 * depth[i]);
    if (asleep[i] == kBodies - kFloor) return std::printf("all are asleep after %d steps\n", i + 1), 0;
  }
  return std::puts("the cubes do not come to rest"), 1;
}
