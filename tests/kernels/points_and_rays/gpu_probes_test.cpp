#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>
#include <string>
#include <thread>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/contact/contact_query_fixture.h"
#include "kernels/geometry/triangle_distance.h"
#include "kernels/points_and_rays/hostile_probes.h"
#include "kernels/refit/bent_mesh.h"
#include "tandem/kernels/gpu_probe_query.h"
#include "tandem/kernels/gpu_scene.h"

// Points and rays on a GPU against the CPU, whose own tests compare with rational numbers.
namespace tandem {
namespace {

using test::GpuTest;
using test::hostile_points;
using test::hostile_rays;
using test::PosedTriangle;
using test::Rays;
using test::rays_from_inside;
using Places = std::vector<test::Place>;
using Bodies = std::vector<std::vector<PosedTriangle>>;

/// This holds the same bodies on the CPU and on the GPU.
struct Both {
  explicit Both(const BodyScene& bodies) : Both(bodies.assets.views(), bodies.instances) {}
  Both(std::span<const AssetView> views, std::span<const Instance> instances) {
    for (Scene* const scene : {&cpu, static_cast<Scene*>(&gpu)}) {
      EXPECT_EQ(scene->set_assets(views), Status::kOk);
      EXPECT_EQ(scene->place(instances), Status::kOk);
    }
    EXPECT_EQ(cpu.set_threads(std::clamp(std::thread::hardware_concurrency(), 1u, 64u)), Status::kOk);
  }

  Scene cpu;
  GpuScene gpu;
};

std::string text_of(const RayHit& hit) {
  std::ostringstream out;
  out << "ray " << hit.ray << " t " << hit.t << " body " << hit.body << " triangle " << hit.triangle
      << " weights " << hit.weight[0] << ' ' << hit.weight[1];
  return out.str();
}

std::string text_of(const ClosestPoint& row) {
  std::ostringstream out;
  out << '[' << row.lower << ", " << row.upper << "] body " << row.body << " triangle " << row.triangle
      << " within " << row.within << " winding " << row.winding;
  return out.str();
}

/// The rows are the same bytes; names those that are not.
void expect_same_hits(std::span<const RayHit> gpu, std::span<const RayHit> cpu) {
  ASSERT_EQ(gpu.size(), cpu.size());
  int shown = 0;
  for (std::size_t i = 0; i < cpu.size() && shown < 5; ++i) {
    if (std::memcmp(&gpu[i], &cpu[i], sizeof(RayHit)) == 0) continue;
    ADD_FAILURE() << "row " << i << ": GPU " << text_of(gpu[i]) << ", CPU " << text_of(cpu[i]);
    ++shown;
  }
}

/// Returns whether the CPU answers; where it refuses a coordinate, the GPU is expected to refuse the same.
template <typename Query, typename Options>
bool find(Both& scenes, const Options& options, Query& cpu, Query& gpu) {
  const Status status = cpu.find(scenes.cpu, options);
  EXPECT_EQ(gpu.find(scenes.gpu, options), status) << scenes.gpu.where();
  if (status == Status::kOutOfRange) {
    EXPECT_EQ(scenes.gpu.where(), scenes.cpu.where());
  } else {
    EXPECT_EQ(status, Status::kOk) << scenes.cpu.where();
  }
  return status == Status::kOk;
}

void expect_same_rays(Both& scenes, const Rays& rays, double reach = HUGE_VAL) {
  for (const RayHits hits : {RayHits::first, RayHits::all}) {
    SCOPED_TRACE(hits == RayHits::first ? "first hits" : "all hits");
    RayOptions options = rays.options(hits);
    options.reach = reach;
    RayQuery cpu, gpu;
    if (!find(scenes, options, cpu, gpu)) return;
    expect_same_hits(gpu.rows(), cpu.rows());
    EXPECT_EQ(gpu.counters().hits, cpu.counters().hits);
    EXPECT_EQ(gpu.counters().rays, cpu.counters().rays);
  }
  // Any hit is one of all.
  RayOptions options = rays.options(RayHits::any);
  options.reach = reach;
  RayQuery any, all;
  ASSERT_EQ(any.find(scenes.gpu, options), Status::kOk);
  options.hits = RayHits::all;
  ASSERT_EQ(all.find(scenes.cpu, options), Status::kOk);
  std::vector<RayHit> of_ray;
  std::size_t next = 0;
  for (const RayHit& hit : any.rows()) {
    bool found = false;
    std::size_t count = 0;
    for (; next < all.rows().size() && all.rows()[next].ray == hit.ray; ++next, ++count)
      found = found || std::memcmp(&all.rows()[next], &hit, sizeof hit) == 0;
    ASSERT_EQ(found, count != 0) << text_of(hit);
    ASSERT_EQ(hit.body == kNoIndex, count == 0) << text_of(hit);
  }
}

/// What is certified holds of both: the intervals meet, and are as narrow; what is exact is equal.
void expect_same_point(const ClosestPoint& gpu, const ClosestPoint& cpu, const test::Place& point,
                       const Bodies& bodies, const ClosestOptions& options) {
  EXPECT_EQ(gpu.within, cpu.within);
  EXPECT_EQ(gpu.winding, cpu.winding);
  EXPECT_EQ(gpu.upper == 0, cpu.upper == 0);
  if (gpu.body == kNoIndex || cpu.body == kNoIndex) {
    // Near the reach only one of them may tell that a body is beyond.
    EXPECT_GE(gpu.upper, options.reach);
    EXPECT_GE(cpu.upper, options.reach);
    EXPECT_TRUE(gpu.body != kNoIndex || (gpu.lower >= options.reach && gpu.upper == HUGE_VAL));
    return;
  }
  EXPECT_LE(gpu.lower, cpu.upper);
  EXPECT_LE(cpu.lower, gpu.upper);
  EXPECT_LE(gpu.upper - gpu.lower, allowed_width(options.tolerance, gpu.upper));
  if (gpu.body == cpu.body && gpu.triangle == cpu.triangle) {
    EXPECT_EQ(gpu.face, cpu.face);
    return;
  }
  const TrianglePair pair = test::pair_of(bodies[gpu.body][gpu.triangle], {point, point, point});
  EXPECT_LE(triangle_distance(pair).interval.lower, gpu.upper) << "of the triangle that the GPU names";
}

void expect_same_points(Both& scenes, const Places& points, const Bodies& bodies, bool sides,
                        double reach = HUGE_VAL, double relative = 1e-6) {
  const ClosestOptions options = {
      .points = points, .tolerance = {0, relative}, .reach = reach, .sides = sides};
  ClosestQuery cpu, gpu;
  if (!find(scenes, options, cpu, gpu)) return;
  ASSERT_EQ(gpu.rows().size(), points.size());
  EXPECT_EQ(gpu.counters().points, points.size());
  int shown = 0;
  for (std::size_t i = 0; i < points.size() && shown < 5; ++i) {
    const ClosestPoint &row = gpu.rows()[i], &wanted = cpu.rows()[i];
    SCOPED_TRACE(testing::Message() << "point " << i << ": GPU " << text_of(row) << ", CPU "
                                    << text_of(wanted));
    expect_same_point(row, wanted, points[i], bodies, options);
    shown += testing::Test::HasFailure();
  }
}

class GpuProbes : public test::GpuTestOf<test::SceneFamily> {};

INSTANTIATE_TEST_SUITE_P(All, GpuProbes, testing::ValuesIn(test::scene_families()),
                         test::family_name<testing::TestParamInfo<test::SceneFamily>>);

TEST_P(GpuProbes, FindWhatTheCpuFinds) {
  for (int trial = 0; trial < test::trials(3, 20) && !HasFailure(); ++trial) {
    SCOPED_TRACE(testing::Message() << "trial " << trial);
    RandomPoses random(291 + static_cast<std::uint64_t>(trial));
    const BodyScene bodies = GetParam().make(random);
    const Bodies triangles = test::in_leaf_order(bodies);
    const auto flat = test::all_of(triangles);
    if (flat.empty()) continue;
    Both scenes(bodies);
    expect_same_rays(scenes, hostile_rays(random, flat, test::size_of(flat), 500));
    expect_same_rays(scenes, hostile_rays(random, flat, test::size_of(flat), 300), 1);
    const Places points = hostile_points(random, triangles, 500);
    expect_same_points(scenes, points, triangles, true);
    expect_same_points(scenes, points, triangles, false, HUGE_VAL, 0x1p-48);
    expect_same_points(scenes, points, triangles, true, 0.25 * test::size_of(flat));
    expect_same_points(scenes, points, triangles, true, 0);
  }
}

TEST_F(GpuTest, NoRaySlipsThroughAnEdgeOrACorner) {
  BodyScene bodies;
  bodies.assets.add(test::cube(1, 8));
  bodies.instances.push_back({0, kIdentityPose});
  RandomPoses random(3);
  for (int turn = 0; turn < 3; ++turn) {
    SCOPED_TRACE(testing::Message() << "turn " << turn);
    if (turn != 0) bodies.instances[0].pose = test::any_rotation(random);
    Both scenes(bodies);
    const Rays rays = rays_from_inside(random, test::in_leaf_order(bodies)[0], test::trials(20000, 20));
    RayQuery first;
    ASSERT_EQ(first.find(scenes.gpu, rays.options(RayHits::first)), Status::kOk);
    EXPECT_EQ(first.counters().hits, rays.origins.size());
    expect_same_rays(scenes, rays);
  }
}

TEST_F(GpuTest, PointsOnASurfaceAreAtDistanceZero) {
  BodyScene bodies;
  bodies.assets.add(test::cube(1, 8));
  bodies.instances = {{0, kIdentityPose}, {0, at(1.5, 0.25, 0)}};
  const Bodies triangles = test::in_leaf_order(bodies);
  Places points;
  for (const PosedTriangle& t : test::all_of(triangles)) {
    points.push_back(t[0]);
    // Sums of such numbers are exact, so these are on an edge and within the triangle.
    points.push_back({(t[0][0] + t[1][0]) / 2, (t[0][1] + t[1][1]) / 2, (t[0][2] + t[1][2]) / 2});
    test::Place inner;
    for (std::size_t k = 0; k < 3; ++k) inner[k] = t[0][k] / 2 + t[1][k] / 4 + t[2][k] / 4;
    points.push_back(inner);
  }
  Both scenes(bodies);
  ClosestQuery query;
  ASSERT_EQ(query.find(scenes.gpu, {.points = points, .sides = true}), Status::kOk);
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_EQ(query.rows()[i].upper, 0) << i;
  expect_same_points(scenes, points, triangles, true);
}

TEST_F(GpuTest, FarAwayNumbersAreAsRight) {
  for (const double far : {1e6, 1e15, 1e290}) {
    SCOPED_TRACE(testing::Message() << "at " << far);
    BodyScene bodies;
    bodies.assets.add(test::cube(1, 4));
    bodies.instances = {{0, kIdentityPose}, {0, at(far, -far, 0)}};
    const Bodies triangles = test::in_leaf_order(bodies);
    RandomPoses random(9);
    Places points;
    Rays rays;
    for (int i = 0; i < 2000; ++i) {
      const test::Place near = test::random_place(random, 2);
      const bool moved = i % 2 != 0;
      points.push_back({near[0] + (moved ? far : 0), near[1] - (moved ? far : 0), near[2]});
      points.push_back({far, near[1], near[2] * far});
      rays.add({far, near[1] - far, near[2]}, {-far * near[0], far, near[2] * near[0]});
      rays.add(points.back(), {near[0] - points.back()[0], near[1] - points.back()[1], -points.back()[2]});
      rays.add({near[0], near[1], far}, {0, 0, -1 / far});
    }
    Both scenes(bodies);
    expect_same_points(scenes, points, triangles, true);
    expect_same_rays(scenes, rays);
  }
}

TEST_F(GpuTest, DirectionsOfAnySizeAreTaken) {
  BodyScene bodies;
  bodies.assets.add(test::cube(1, 2));
  bodies.instances = {{0, kIdentityPose}};
  Both scenes(bodies);
  RandomPoses random(10);
  Rays rays;
  for (const double size : {1e-300, 1e-310, 5e-324, 1e-30, 1e30, 1e300}) {
    for (const double far : {3.0, 1e20, 1e290}) {
      rays.add({0.25, 0.125, far}, {0, 0, -size});
      rays.add({0.25, 0.125, far}, {0, 0, size});
      // Numbers that need many words of exact arithmetic, on edges of the cube's triangles.
      rays.add({0.25, 0, far}, {size / 4, 0, -size});
      rays.add({0, 0, far}, {0, 1e-320, -size});
    }
  }
  expect_same_rays(scenes, rays);
}

TEST_F(GpuTest, WhatIsNoPointAndNoRayIsNamed) {
  const BodyScene cubes = row_of_cubes(2);
  Both scenes(cubes);
  ClosestQuery closest;
  RayQuery rays;
  Places points(1000, {0, 0, 5}), along(1000, {0, 0, -1});
  points[700][1] = std::nan("");
  EXPECT_EQ(closest.find(scenes.gpu, {.points = points}), Status::kOutOfRange);
  EXPECT_EQ(scenes.gpu.where(), 700u);
  EXPECT_EQ(rays.find(scenes.gpu, {.origins = points, .directions = along}), Status::kOutOfRange);
  EXPECT_EQ(scenes.gpu.where(), 700u);
  points[700][1] = 0;
  along[300] = {0, -0.0, 0};
  EXPECT_EQ(rays.find(scenes.gpu, {.origins = points, .directions = along}), Status::kNoDirection);
  EXPECT_EQ(scenes.gpu.where(), 300u);
  EXPECT_TRUE(rays.rows().empty());
  ASSERT_EQ(closest.find(scenes.gpu, {}), Status::kOk);
  ASSERT_EQ(rays.find(scenes.gpu, {}), Status::kOk);
  EXPECT_TRUE(closest.rows().empty() && rays.rows().empty());
  ASSERT_EQ(scenes.gpu.place({}), Status::kOk);
  ASSERT_EQ(closest.find(scenes.gpu, {.points = points, .sides = true}), Status::kOk);
  EXPECT_EQ(closest.rows()[999].body, kNoIndex);
  EXPECT_EQ(closest.rows()[999].lower, HUGE_VAL);
  along[300] = {0, 0, 1};
  for (const RayHits hits : {RayHits::first, RayHits::any, RayHits::all}) {
    ASSERT_EQ(rays.find(scenes.gpu, {.origins = points, .directions = along, .hits = hits}), Status::kOk);
    EXPECT_EQ(rays.rows().size(), hits == RayHits::all ? 0u : 1000u);
    EXPECT_EQ(rays.counters().hits, 0u);
  }
}

TEST_F(GpuTest, RemovedMovedAndManyBodiesAreSeen) {
  const BodyScene bodies = crowd(5, 500);
  Both scenes(bodies);
  const Bodies triangles = test::in_leaf_order(bodies);
  const auto flat = test::all_of(triangles);
  RandomPoses random(8);
  const Rays rays = hostile_rays(random, flat, test::size_of(flat), 3000);
  const Places points = hostile_points(random, triangles, 3000);
  expect_same_rays(scenes, rays);
  expect_same_points(scenes, points, triangles, true);
  for (std::uint32_t i = 0; i < 500; i += 3) {
    EXPECT_EQ(scenes.cpu.remove(i), Status::kOk);
    EXPECT_EQ(scenes.gpu.remove(i), Status::kOk);
  }
  expect_same_rays(scenes, rays);
  expect_same_points(scenes, points, triangles, true);
  for (std::uint32_t i = 1; i < 500; i += 3) {
    const Pose pose = at(0.01 * i, -0.02 * i, 1);
    EXPECT_EQ(scenes.cpu.move(i, pose), Status::kOk);
    EXPECT_EQ(scenes.gpu.move(i, pose), Status::kOk);
  }
  expect_same_rays(scenes, rays);
}

TEST_F(GpuTest, OpenAndInsideOutSurfacesHaveTheSidesOfTheCpu) {
  BodyScene bodies;
  bodies.assets.add(test::joined(test::box(2, 2, 2), test::box(1, 1, 1)));
  bodies.assets.add(test::joined(test::box(1, 2, 1), test::sheet(1, 2)));
  bodies.assets.add(test::ring(7, 2, 5, 0.5));
  bodies.assets.add(test::sheet(2, 3));
  RandomPoses random(31);
  for (std::uint32_t i = 0; i < 8; ++i) bodies.instances.push_back({i % 4, test::any_rotation(random)});
  Both scenes(bodies);
  const Bodies triangles = test::in_leaf_order(bodies);
  expect_same_points(scenes, hostile_points(random, triangles, 5000), triangles, true);
}

TEST_F(GpuTest, DeformedBodiesAreAskedAsTheyAre) {
  const test::Mesh mesh = test::welded(test::cube(1, 4));
  const test::Bytes file(test::make_refittable_file(mesh));
  const AssetView view = file.check().asset;
  const Instance instances[] = {{0, kIdentityPose}, {0, at(1.5, 0.25, 0)}};
  Both scenes({&view, 1}, instances);
  test::Positions positions = test::positions_of(mesh);
  for (auto& p : positions) p[0] *= 1 + 0.25 * p[2], p[1] += 0.125 * p[0];
  RandomPoses random(12);
  Rays rays;
  for (int i = 0; i < 5000; ++i) rays.add(test::random_place(random, 3), test::random_place(random, 1));
  const auto expect_same_of = [&](const auto& bent) {
    ASSERT_EQ(scenes.cpu.deform(0, bent), Status::kOk);
    ASSERT_EQ(scenes.gpu.deform(0, bent), Status::kOk);
    expect_same_rays(scenes, rays);
    ClosestQuery cpu, gpu;
    ASSERT_EQ(cpu.find(scenes.cpu, {.points = rays.origins, .sides = true}), Status::kOk);
    ASSERT_EQ(gpu.find(scenes.gpu, {.points = rays.origins, .sides = true}), Status::kOk);
    for (std::size_t i = 0; i < rays.origins.size(); ++i) {
      ASSERT_LE(gpu.rows()[i].lower, cpu.rows()[i].upper) << i;
      ASSERT_LE(cpu.rows()[i].lower, gpu.rows()[i].upper) << i;
      ASSERT_EQ(gpu.rows()[i].within, cpu.rows()[i].within) << i;
    }
  };
  expect_same_of(test::single(positions));
  for (auto& p : positions) p[0] /= 3, p[2] /= 7;
  rays.add({positions[0][0], positions[0][1], -5}, {0, 0, 1});  // meets a vertex that float32 has not
  expect_same_of(test::flat(positions));
}

TEST_F(GpuTest, AMillionProbesAreThoseOfTheCpu) {
  constexpr int kMany = 1000000;
  BodyScene bodies;
  bodies.assets.add(test::cube(1, 40));
  RandomPoses random(14);
  for (int i = 0; i < 20; ++i) bodies.instances.push_back({0, random.pose({1, 1, 4, 0, 4})});
  Both scenes(bodies);
  Rays rays;
  for (int i = 0; i < kMany; ++i) rays.add(test::random_place(random, 6), test::random_place(random, 1));
  RayQuery cpu_rays, gpu_rays;
  ASSERT_EQ(cpu_rays.find(scenes.cpu, rays.options(RayHits::first)), Status::kOk);
  ASSERT_EQ(gpu_rays.find(scenes.gpu, rays.options(RayHits::first)), Status::kOk);
  EXPECT_GT(cpu_rays.counters().hits, 1000u);
  expect_same_hits(gpu_rays.rows(), cpu_rays.rows());
  expect_same_points(scenes, rays.origins, test::in_leaf_order(bodies), true);
}

/// Points and rays in GPU memory, about a crowd.
struct OnGpu {
  OnGpu()
      : bodies(crowd(6, 60)),
        scene(bodies.assets, bodies.instances, {}),
        rays(make_rays(bodies)),
        origins(upload(rays.origins)),
        directions(upload(rays.directions)) {}

  static Rays make_rays(const BodyScene& of) {
    RandomPoses random(15);
    const auto flat = test::all_of(test::in_leaf_order(of));
    return hostile_rays(random, flat, test::size_of(flat), 4000);
  }
  static GpuArray<double> upload(const Places& places) {
    std::vector<double> numbers;
    for (const test::Place& place : places) numbers.insert(numbers.end(), place.begin(), place.end());
    return test::on_gpu(numbers);
  }
  std::uint32_t count() const { return static_cast<std::uint32_t>(rays.origins.size()); }
  GpuRayOptions options(RayHits hits) const {
    return {.origins = origins.data(), .directions = directions.data(), .ray_count = count(), .hits = hits};
  }
  GpuClosestOptions closest() const {
    return {.points = origins.data(), .point_count = count(), .sides = true};
  }

  BodyScene bodies;
  test::GpuScene scene;
  Rays rays;
  GpuArray<double> origins, directions;
};

TEST_F(GpuTest, RoomThatRunsOutIsReportedAndMade) {
  const OnGpu on;
  GpuProbeQuery query;
  ASSERT_EQ(query.set_assets(on.scene.assets(), nullptr), Status::kOk);
  EXPECT_EQ(query.enqueue(on.scene.instances(), on.options(RayHits::first), nullptr), Status::kOutOfRange);
  ASSERT_EQ(query.reserve({60, on.count(), 10, 0}), Status::kOk);
  ASSERT_EQ(query.enqueue(on.scene.instances(), on.options(RayHits::all), nullptr), Status::kOk);
  ASSERT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  EXPECT_EQ(query.report().status, Status::kOk);
  EXPECT_EQ(query.report().complete, 0u);
  EXPECT_GT(query.report().needed.hits, 10u);
  ASSERT_EQ(query.find(on.scene.instances(), on.options(RayHits::all), nullptr), Status::kOk);
  EXPECT_NE(query.report().complete, 0u);
  std::printf("%u rays, %u not decided by float64, %u hits\n", on.count(), query.report().exact,
              query.report().rows);
  const auto found = test::download(query.hits(), query.report().rows);
  Scene cpu;
  ASSERT_EQ(cpu.set_assets(on.bodies.assets.views()), Status::kOk);
  ASSERT_EQ(cpu.place(on.bodies.instances), Status::kOk);
  RayQuery wanted;
  ASSERT_EQ(wanted.find(cpu, on.rays.options(RayHits::all)), Status::kOk);
  expect_same_hits(found, wanted.rows());
}

TEST_F(GpuTest, ProbesHaveTheSameBytesOnEveryRun) {
  const OnGpu on;
  std::vector<ClosestPoint> points;
  std::vector<RayHit> hits;
  for (int run = 0; run < 3; ++run) {
    GpuProbeQuery closest, rays;
    ASSERT_EQ(closest.set_assets(on.scene.assets(), nullptr), Status::kOk);
    ASSERT_EQ(rays.set_assets(on.scene.assets(), nullptr), Status::kOk);
    ASSERT_EQ(closest.find(on.scene.instances(), on.closest(), nullptr), Status::kOk);
    ASSERT_EQ(rays.find(on.scene.instances(), on.options(RayHits::any), nullptr), Status::kOk);
    const auto these = test::download(closest.closest(), on.count());
    const auto those = test::download(rays.hits(), rays.report().rows);
    if (run == 0) points = these, hits = those;
    EXPECT_EQ(std::memcmp(these.data(), points.data(), these.size() * sizeof(ClosestPoint)), 0) << run;
    EXPECT_EQ(std::memcmp(those.data(), hits.data(), those.size() * sizeof(RayHit)), 0) << run;
  }
}

TEST_F(GpuTest, OneQueryAnswersPointsAndRaysInTurn) {
  const OnGpu on;
  GpuProbeQuery alone, both;
  ASSERT_EQ(alone.set_assets(on.scene.assets(), nullptr), Status::kOk);
  ASSERT_EQ(both.set_assets(on.scene.assets(), nullptr), Status::kOk);
  ASSERT_EQ(alone.find(on.scene.instances(), on.closest(), nullptr), Status::kOk);
  const auto points = test::download(alone.closest(), on.count());
  for (const RayHits hits : {RayHits::all, RayHits::first, RayHits::all}) {
    ASSERT_EQ(alone.find(on.scene.instances(), on.options(hits), nullptr), Status::kOk);
    ASSERT_EQ(both.find(on.scene.instances(), on.options(hits), nullptr), Status::kOk);
    ASSERT_EQ(both.report().rows, alone.report().rows);
    expect_same_hits(test::download(both.hits(), both.report().rows),
                     test::download(alone.hits(), alone.report().rows));
    ASSERT_EQ(both.find(on.scene.instances(), on.closest(), nullptr), Status::kOk);
    ASSERT_EQ(both.report().rows, on.count());
    EXPECT_EQ(both.report().counters.hits, 0u);
    const auto these = test::download(both.closest(), on.count());
    EXPECT_EQ(std::memcmp(these.data(), points.data(), these.size() * sizeof(ClosestPoint)), 0);
  }
}

TEST_F(GpuTest, ProbesAreCapturedIntoAGraph) {
  const OnGpu on;
  test::GraphStream stream;
  GpuProbeQuery closest, rays;
  ASSERT_EQ(closest.set_assets(on.scene.assets(), nullptr), Status::kOk);
  ASSERT_EQ(rays.set_assets(on.scene.assets(), nullptr), Status::kOk);
  ASSERT_EQ(closest.find(on.scene.instances(), on.closest(), nullptr), Status::kOk);
  ASSERT_EQ(rays.find(on.scene.instances(), on.options(RayHits::all), nullptr), Status::kOk);
  const auto points = test::download(closest.closest(), on.count());
  const auto hits = test::download(rays.hits(), rays.report().rows);
  stream.capture([&] {
    const Status status = closest.enqueue(on.scene.instances(), on.closest(), stream.get());
    return status == Status::kOk ? rays.enqueue(on.scene.instances(), on.options(RayHits::all), stream.get())
                                 : status;
  });
  for (int launch = 0; launch < 2; ++launch) {
    stream.launch();
    ASSERT_NE(closest.report().complete, 0u);
    ASSERT_EQ(rays.report().rows, hits.size());
    const auto these = test::download(closest.closest(), on.count());
    EXPECT_EQ(std::memcmp(these.data(), points.data(), these.size() * sizeof(ClosestPoint)), 0);
    expect_same_hits(test::download(rays.hits(), rays.report().rows), hits);
  }
}

TEST_F(GpuTest, WhatIsWrongWithBodiesAndOptionsIsNamed) {
  const OnGpu on;
  GpuProbeQuery closest, rays;
  ASSERT_EQ(closest.set_assets(on.scene.assets(), nullptr), Status::kOk);
  ASSERT_EQ(rays.set_assets(on.scene.assets(), nullptr), Status::kOk);
  BodyScene wrong = crowd(6, 60);
  wrong.instances[33].pose.rotation[0][0] = 2;
  const test::GpuScene scene(wrong.assets, wrong.instances, {});
  EXPECT_EQ(closest.find(scene.instances(), on.closest(), nullptr), Status::kPoseNotRigid);
  EXPECT_EQ(closest.report().where, 33u);
  EXPECT_EQ(rays.find(scene.instances(), on.options(RayHits::first), nullptr), Status::kPoseNotRigid);
  EXPECT_EQ(rays.report().where, 33u);
  GpuClosestOptions of_points = on.closest();
  of_points.tolerance.relative = -1;
  EXPECT_EQ(closest.find(on.scene.instances(), of_points, nullptr), Status::kBadTolerance);
  GpuRayOptions of_rays = on.options(RayHits::first);
  of_rays.reach = std::nan("");
  EXPECT_EQ(rays.find(on.scene.instances(), of_rays, nullptr), Status::kBadReach);
}

}  // namespace
}  // namespace tandem
