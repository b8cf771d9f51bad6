#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <thread>

#include "kernels/scene/gpu_broad_phase_fixture.h"

namespace tandem {
namespace {

using test::Boxes;
using test::download;
using test::kFew;
using test::kMany;
using test::of_cpu;
using test::on_gpu;
using test::Pairs;
using test::same;
using test::stored;

class GpuBroadPhaseTest : public test::GpuTest {};

Pairs of_gpu(GpuBroadPhase& broad_phase, const Boxes& boxes, const GpuBroadPhaseOptions& options) {
  return test::of_gpu(broad_phase, on_gpu(boxes), boxes.size(), options);
}

void expect_same_as_cpu(GpuBroadPhase& broad_phase, const Boxes& boxes, const std::string& what) {
  const Pairs expected = of_cpu(boxes);
  EXPECT_TRUE(same(of_gpu(broad_phase, boxes, {}), expected)) << what << ", " << expected.size() << " pairs";
  EXPECT_TRUE(same(of_gpu(broad_phase, boxes, {true}), expected)) << what << ", sorted";
}

// The edge of equal cubes in the unit cube that have so many neighbours each.
double edge_for(std::size_t count, double neighbours) {
  return 0.5 * std::cbrt(neighbours / static_cast<double>(count));
}

// Boxes in the unit cube, edges up to `edge`, `spread` orders of magnitude apart.
Boxes scattered(std::size_t count, double edge, double spread, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Boxes boxes(count);
  for (WorldBox& box : boxes) {
    const double size = edge * std::pow(10, -spread * uniform(random));
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = uniform(random);
      box.hi[k] = box.lo[k] + size * (0.5 + uniform(random));
    }
  }
  return boxes;
}

Boxes transformed(Boxes boxes, double scale, double offset) {
  for (WorldBox& box : boxes) {
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = box.lo[k] * scale + offset;
      box.hi[k] = box.hi[k] * scale + offset;
    }
  }
  return boxes;
}

// Unit cubes on a lattice, each of which touches 26 others exactly.
Boxes lattice(int side, double offset) {
  Boxes boxes;
  for (int i = 0; i < side * side * side; ++i) {
    const double x = offset + i % side, y = offset + i / side % side, z = offset + i / side / side;
    boxes.push_back({{x, y, z}, {x + 1, y + 1, z + 1}});
  }
  return boxes;
}

TEST_F(GpuBroadPhaseTest, AnyNumberOfBoxes) {
  GpuBroadPhase broad_phase;
  std::vector<std::uint32_t> counts = {0, 1000, kFew, 2 * kFewBoxes, 33000};
  for (const std::uint32_t count : {2u, 4u, 32u, 64u, 128u, 1024u, kFewBoxes})
    counts.insert(counts.end(), {count - 1, count, count + 1});
  for (const std::uint32_t count : counts) {
    for (const double spread : {0.0, 3.0}) {
      const double edge = 4 * edge_for(count + 1, 6);
      expect_same_as_cpu(broad_phase, scattered(count, edge, spread, count), std::to_string(count));
    }
  }
}

// Fewer boxes where the CPU's way is quadratic.
void check_distributions(const std::size_t count, const std::size_t fewer) {
  const int side = static_cast<int>(std::cbrt(static_cast<double>(count)));
  const double edge = edge_for(count, 6.5);
  GpuBroadPhase broad_phase;
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const auto check = [&](const char* what, const Boxes& boxes) {
    expect_same_as_cpu(broad_phase, boxes, what);
  };

  check("uniform", scattered(count, edge, 0, 1));
  check("twenty neighbours", scattered(count, edge_for(count, 20), 0, 2));
  check("six orders of size", scattered(count, 30 * edge, 6, 3));
  check("far", transformed(scattered(count, edge, 0, 4), 100, 1e7));
  check("very far", transformed(scattered(count, edge, 0, 5), 100, 1e15));
  check("huge", transformed(scattered(count, edge, 1, 6), 1e299, -1e299));
  check("tiny", transformed(scattered(count, edge, 1, 7), 1e-300, 0));
  check("touching", lattice(side, 0.1));
  check("touching, far", lattice(side, 1e15));

  Boxes plane = scattered(count, edge_for(count, 6.5), 0, 8);
  for (WorldBox& box : plane) {
    box.lo[2] = 0;
    box.hi[2] = edge;
  }
  check("plane", plane);

  Boxes clusters = scattered(fewer, edge, 0, 9);
  for (std::size_t i = 0; i < fewer; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double shift = i % 7 == 0 ? 0 : std::pow(10, static_cast<double>(i % 7));
      clusters[i].lo[k] += shift;
      clusters[i].hi[k] += shift;
    }
  }
  check("clusters", clusters);

  Boxes flown = scattered(fewer, edge_for(fewer, 6.5), 0, 10);
  for (std::size_t i = 0; i < 5; ++i) {
    WorldBox& box = flown[i * fewer / 20];  // the first of all too
    box.lo[0] = std::pow(10, 60.0 * static_cast<double>(i + 1) - 20);
    box.hi[0] = 2 * box.lo[0];
  }
  check("some flown away", flown);

  Boxes bell = scattered(count, 0.01, 1, 11);
  for (WorldBox& box : bell) {
    for (int k = 0; k < 3; ++k) {
      const double shift = std::pow(normal(random), 3);
      box.lo[k] += shift;
      box.hi[k] += shift;
    }
  }
  check("dense in the middle", bell);

  Boxes sticks = scattered(count, edge / 2, 0, 12);
  for (std::size_t i = 0; i < count; i += 100) sticks[i].hi[i / 100 % 3] += 1;
  check("sticks", sticks);

  Boxes grounds = scattered(fewer, edge_for(fewer, 6.5), 0, 13);
  grounds[0] = {{-1e12, -1e12, -1e12}, {1e12, 1e12, 0.5}};
  grounds[fewer - 1] = {{-1, -1, -1}, {2, 2, 0.01}};
  grounds[fewer / 2] = {{-1e300, -1e300, -1e300}, {1e300, 1e300, 1e300}};
  check("grounds", grounds);
}

TEST_F(GpuBroadPhaseTest, ManyDistributionsOfFewBoxes) {
  check_distributions(kFew, kFew);
}

TEST_F(GpuBroadPhaseTest, ManyDistributionsOfManyBoxes) {
  check_distributions(100000, kMany);
}

TEST_F(GpuBroadPhaseTest, BoxesInOnePlace) {
  GpuBroadPhase broad_phase;
  expect_same_as_cpu(broad_phase, Boxes(kFew, {{1, 2, 3}, {1, 2, 3}}), "points");
  expect_same_as_cpu(broad_phase, Boxes(kFew, {{-1, -1, -1}, {1, 1, 1}}), "cubes");
  expect_same_as_cpu(broad_phase, Boxes(kFew, {{0, 0, 0}, {0, 0, 0}}), "nothing");
  Boxes nested;
  for (std::uint32_t i = 0; i < kFew; ++i) {
    const double size = std::pow(1.1, i);
    nested.push_back({{-size, -size, -size}, {size, size, size}});
  }
  expect_same_as_cpu(broad_phase, nested, "nested");
  Boxes places;
  for (std::uint32_t i = 0; i < kMany; ++i) {
    const double x = i % 25;
    places.push_back({{x, 0, 0}, {x + 0.5 * (i % 2), 1, 1}});
  }
  expect_same_as_cpu(broad_phase, places, "in 25 places");
}

TEST_F(GpuBroadPhaseTest, SubnormalNumbersAreDecidedAsTheyAre) {
  constexpr double kLeast = std::numeric_limits<double>::denorm_min();
  GpuBroadPhase broad_phase;
  for (const int side : {14, 28}) {
    Boxes boxes = lattice(side, 0);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        boxes[i].lo[k] *= 3 * kLeast;
        boxes[i].hi[k] = boxes[i].lo[k] + static_cast<double>(i % 4) * kLeast;
      }
    }
    expect_same_as_cpu(broad_phase, boxes, "all subnormal");
    boxes.push_back({{-1, -1, -1}, {1, 1, 1}});
    boxes.push_back({{kLeast, -1, -1}, {1, 1, 1}});
    expect_same_as_cpu(broad_phase, boxes, "subnormal in the middle of a large one");
  }
}

TEST_F(GpuBroadPhaseTest, TouchingByTheLastBitIsMeeting) {
  GpuBroadPhase broad_phase;
  for (const double x : {1.0, 0.1, 1e7 + 0.1, -3e-200, 1e299}) {
    const double next = std::nextafter(x, 1e300), size = std::fmax(1, std::fabs(x));
    Boxes boxes = {{{x - size, 0, 0}, {x, 1, 1}},
                   {{x, 0, 0}, {x + size, 1, 1}},
                   {{next, 0, 0}, {x + size, 1, 1}},
                   {{x - 1e3, 5, 5}, {x + 1e3, 6, 6}}};
    EXPECT_TRUE(same(of_gpu(broad_phase, boxes, {true}), {{0, 1}, {1, 2}})) << x;
    for (std::uint32_t i = 0; i < kMany; ++i) {
      const double y = 10 + 2.0 * i;
      boxes.push_back({{x, y, 0}, {x, y + 1, 1}});
    }
    EXPECT_TRUE(same(of_gpu(broad_phase, boxes, {true}), {{0, 1}, {1, 2}})) << x << ", of many";
  }
}

TEST_F(GpuBroadPhaseTest, AMillionBoxes) {
  constexpr std::size_t kCount = 1000000;
  GpuBroadPhase broad_phase;
  expect_same_as_cpu(broad_phase, scattered(kCount, edge_for(kCount, 6.5), 0, 21), "uniform");
  Boxes boxes = scattered(kCount, 3 * edge_for(kCount, 6.5), 2, 22);
  boxes[77] = {{-10, -10, -10}, {10, 10, 10}};
  expect_same_as_cpu(broad_phase, boxes, "mixed sizes on a ground");
}

void expect_overflow_is_reported(const Boxes& boxes) {
  const auto device = on_gpu(boxes);
  for (const bool sorted : {false, true}) {
    GpuBroadPhase broad_phase;
    test::expect_overflow_is_reported(broad_phase, device, static_cast<std::uint32_t>(boxes.size()), {sorted},
                                      of_cpu(boxes));
  }
}

TEST_F(GpuBroadPhaseTest, OverflowIsReportedAndARetryLosesNothing) {
  for (const std::uint32_t count : {kFew, kMany})
    expect_overflow_is_reported(scattered(count, edge_for(count, 20), 0, 31));
  expect_overflow_is_reported(Boxes(100, {{1, 2, 3}, {4, 5, 6}}));
  expect_overflow_is_reported(Boxes(kFew, {{1, 2, 3}, {4, 5, 6}}));
}

TEST_F(GpuBroadPhaseTest, NamesTheFirstBoxThatItCannotTakeAndGoesOnAfterwards) {
  GpuBroadPhase broad_phase;
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -1.0000001e300}) {
    for (const std::uint32_t count : {1u, 40u, kFew, kMany}) {
      Boxes boxes = scattered(count, 0.1, 0, 41);
      const Boxes good = boxes;
      boxes[count - 1].hi[1] = boxes[count / 2].lo[2] = bad;
      const auto device = on_gpu(boxes);
      EXPECT_EQ(broad_phase.find_pairs(device.data(), count, {}, nullptr), Status::kOutOfRange);
      EXPECT_EQ(broad_phase.report().where, count / 2);
      EXPECT_EQ(stored(broad_phase).size(), 0u);
      EXPECT_EQ(broad_phase.report().found, 0u);
      expect_same_as_cpu(broad_phase, good, "after an error");
    }
  }
  const auto device = on_gpu(Boxes(10, {{0, 0, 0}, {1, 1, 1}}));
  GpuBroadPhase unprepared;
  EXPECT_EQ(unprepared.enqueue(device.data(), 10, {}, nullptr), Status::kOutOfRange);
  EXPECT_EQ(broad_phase.enqueue(test::misaligned(device), 9, {}, nullptr), Status::kMisaligned);
}

Boxes grown_by(Boxes boxes, double margin) {
  for (WorldBox& box : boxes) box = grown(box, margin);
  return boxes;
}

void expect_grown_as_cpu(GpuBroadPhase& broad_phase, const Boxes& boxes, double within) {
  const Boxes larger = grown_by(boxes, 0.5 * within);
  const Pairs expected = of_cpu(larger);
  for (const bool sorted : {false, true}) {
    const Pairs pairs = of_gpu(broad_phase, boxes, {.sorted = sorted, .within = within});
    EXPECT_TRUE(same(pairs, expected)) << boxes.size() << " boxes within " << within << ": " << pairs.size()
                                       << " instead of " << expected.size();
  }
  EXPECT_TRUE(same(download(broad_phase.boxes(), boxes.size()), larger));
  EXPECT_LE(broad_phase.bytes(), most_broad_phase_bytes(broad_phase.capacity(), true));
  expect_same_as_cpu(broad_phase, boxes, "not grown any more");
}

TEST_F(GpuBroadPhaseTest, BoxesWithinADistanceAreThePairsOfTheCpusGrownBoxes) {
  GpuBroadPhase broad_phase;
  for (const std::uint32_t count : {0u, 1u, 2u, 1000u, kFew, kFewBoxes + 1, kMany}) {
    const double edge = edge_for(count + 1, 4);
    for (const double within : {std::numeric_limits<double>::denorm_min(), 0.25 * edge, 2 * edge}) {
      expect_grown_as_cpu(broad_phase, scattered(count, edge, 1, count), within);
      expect_grown_as_cpu(broad_phase, transformed(scattered(count, edge, 1, count), 100, 1e15),
                          100 * within);
    }
  }
  // Gaps of exactly the distance, and one last bit more or less, are as the CPU has them.
  for (const int side : {12, 22}) {
    Boxes cubes = lattice(side, 0.1);
    for (WorldBox& box : cubes) box.hi[0] -= 0.25, box.hi[1] -= 0.3;
    for (const double within : {0.25, std::nextafter(0.25, 0.0), std::nextafter(0.25, 1.0), 0.3})
      expect_grown_as_cpu(broad_phase, cubes, within);
  }
  const Boxes few = scattered(200, 1e-3, 1, 5);
  expect_grown_as_cpu(broad_phase, few, std::numeric_limits<double>::infinity());
  EXPECT_EQ(of_cpu(grown_by(few, std::numeric_limits<double>::infinity())).size(), 200u * 199 / 2);
}

TEST_F(GpuBroadPhaseTest, ADistanceThatIsNoneAndBoxesThatAreNoneAreRefused) {
  Boxes boxes = scattered(kMany, 0.1, 0, 43);
  const auto good = on_gpu(boxes);
  GpuBroadPhase broad_phase;
  ASSERT_EQ(broad_phase.reserve({kMany, 8 * kMany}), Status::kOk);
  for (const double within : {-1.0, -std::numeric_limits<double>::denorm_min(), std::nan("")})
    EXPECT_EQ(broad_phase.enqueue(good.data(), kMany, {.within = within}, nullptr), Status::kBadReach);
  EXPECT_EQ(broad_phase.enqueue(good.data(), kMany, {.within = 1e-3}, nullptr), Status::kOutOfRange)
      << "without room for larger boxes";
  boxes[77].hi[2] = std::nan(""), boxes[78].lo[0] = -1.0000001e300;
  for (const std::uint32_t count : {100u, kFew, kMany}) {
    const auto bad = on_gpu(Boxes(boxes.begin(), boxes.begin() + count));
    EXPECT_EQ(broad_phase.find_pairs(bad.data(), count, {.within = 1e-3}, nullptr), Status::kOutOfRange);
    EXPECT_EQ(broad_phase.report().where, 77u);
    EXPECT_EQ(broad_phase.report().found, 0u);
  }
}

Boxes moved(const Boxes& boxes, const std::vector<std::array<double, 3>>& speeds, double time) {
  Boxes result = boxes;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      result[i].lo[k] += time * speeds[i][k];
      result[i].hi[k] += time * speeds[i][k];
    }
  }
  return result;
}

void expect_frames_take_no_new_memory(std::uint32_t count) {
  const Boxes start = scattered(count, edge_for(count, 6.5), 1, 51);
  std::mt19937_64 random(52);
  std::normal_distribution<double> normal(0, 0.01);
  std::vector<std::array<double, 3>> speeds(start.size());
  for (auto& speed : speeds) speed = {normal(random), normal(random), normal(random)};
  GpuBroadPhase broad_phase;
  ASSERT_EQ(broad_phase.reserve({count, 8 * count}, {true}), Status::kOk);
  const std::size_t bytes = broad_phase.bytes();
  const ObjectPair* place = broad_phase.pairs().pairs;
  for (int frame = 0; frame < 20; ++frame)
    expect_same_as_cpu(broad_phase, moved(start, speeds, frame), std::to_string(frame));
  EXPECT_EQ(broad_phase.bytes(), bytes);
  EXPECT_EQ(broad_phase.pairs().pairs, place);
}

TEST_F(GpuBroadPhaseTest, FramesOfMovingBoxesTakeNoNewMemory) {
  for (const std::uint32_t count : {kFew, kMany}) expect_frames_take_no_new_memory(count);
}

TEST_F(GpuBroadPhaseTest, ObjectsOnSeveralStreamsAndThreadsDoNotDisturbEachOther) {
  const auto work = [](std::uint64_t seed) {
    const std::uint32_t count = seed % 2 == 0 ? kFew : kMany;
    const Boxes boxes = scattered(count, edge_for(count, 10), 1, seed);
    const Pairs expected = of_cpu(boxes);
    const auto device = on_gpu(boxes);
    GpuStream stream;
    ASSERT_EQ(stream.create(), cudaSuccess);
    GpuBroadPhase first;
    ASSERT_EQ(first.reserve({count, 10 * count}, {true}), Status::kOk);
    GpuBroadPhase broad_phase = std::move(first);
    for (int i = 0; i < 20; ++i)
      ASSERT_EQ(broad_phase.enqueue(device.data(), count, {true}, stream.get()), Status::kOk);
    ASSERT_EQ(stream.wait(), cudaSuccess);
    EXPECT_EQ(broad_phase.report().complete, 1u);
    EXPECT_TRUE(same(stored(broad_phase), expected));
  };
  std::vector<std::thread> threads;
  for (std::uint64_t seed = 61; seed < 65; ++seed) threads.emplace_back(work, seed);
  for (std::thread& thread : threads) thread.join();
}

void expect_graph_serves_frames(std::uint32_t count) {
  const Boxes boxes = scattered(count, edge_for(count, 10), 1, 71), later = scattered(count, 0.02, 0, 72);
  const auto device = on_gpu(boxes);
  GpuBroadPhase broad_phase;
  ASSERT_EQ(broad_phase.reserve({count, 10 * count}, {true}), Status::kOk);
  test::GraphStream stream;
  stream.capture([&] { return broad_phase.enqueue(device.data(), count, {true}, stream.get()); });
  for (const Boxes* frame : {&boxes, &later, &boxes}) {
    const auto upload = on_gpu(*frame);
    ASSERT_EQ(cudaMemcpy(device.data(), upload.data(), count * sizeof(WorldBox), cudaMemcpyDeviceToDevice),
              cudaSuccess);
    ASSERT_EQ(cudaDeviceSynchronize(), cudaSuccess);
    stream.launch();
    EXPECT_TRUE(same(stored(broad_phase), of_cpu(*frame)));
  }
}

TEST_F(GpuBroadPhaseTest, MayBeCapturedIntoAGraph) {
  for (const std::uint32_t count : {kFew, kMany}) expect_graph_serves_frames(count);
}

Status find_pairs(GpuBroadPhase& broad_phase, const test::Bodies& bodies,
                  const std::vector<AssetBounds>& bounds, double within = 0) {
  const test::GpuBodies instances(bodies);
  return broad_phase.find_pairs(instances.view(), test::GpuBounds(bounds).view(),
                                {.sorted = true, .within = within}, nullptr);
}

void expect_poses_as_the_cpu(GpuBroadPhase& broad_phase, std::uint32_t count) {
  const std::vector<AssetBounds> bounds = {{{0, 0, 0}, {-1, -0.5f, -0.25f}, {1, 0.5f, 0.75f}},
                                           {{1e6, -2e6, 0.1}, {0, 0, 0}, {3, 2, 1}},
                                           {{0, 0, 0}, {1e-40f, -1e-30f, 0}, {1e-39f, 0, 7}}};
  test::RandomPoses random(81);
  test::Bodies instances;
  for (std::uint32_t i = 0; i < count; ++i) {
    instances.asset.push_back(static_cast<std::uint32_t>(random.below(3)));
    instances.pose.push_back(random.pose({1, 1, i % 2 == 0 ? 1.5 * std::cbrt(0.4 * count) : 1e9, 0, 4}));
  }
  const Boxes boxes = instances.boxes(bounds);
  ASSERT_EQ(find_pairs(broad_phase, instances, bounds), Status::kOk);
  EXPECT_TRUE(same(download(broad_phase.boxes(), boxes.size()), boxes));
  const Pairs expected = of_cpu(boxes);
  EXPECT_GT(expected.size(), count / 20);
  EXPECT_TRUE(same(stored(broad_phase), expected));
  ASSERT_EQ(find_pairs(broad_phase, instances, bounds, 0.3), Status::kOk);
  EXPECT_TRUE(same(stored(broad_phase), of_cpu(grown_by(boxes, 0.15))));
  EXPECT_GT(broad_phase.report().found, expected.size());

  instances.pose[count - 100].translation[0] = 1e301;
  instances.pose[count - 200].rotation[1][1] += 1e-3;
  instances.asset[count - 300] = 3;
  EXPECT_EQ(find_pairs(broad_phase, instances, bounds), Status::kUnknownAsset);
  EXPECT_EQ(broad_phase.report().where, count - 300);
  instances.asset[count - 300] = 2;
  EXPECT_EQ(find_pairs(broad_phase, instances, bounds), Status::kPoseNotRigid);
  EXPECT_EQ(broad_phase.report().where, count - 200);
  instances.pose[count - 200] = kIdentityPose;
  for (const double within : {0.0, 0.3}) {
    EXPECT_EQ(find_pairs(broad_phase, instances, bounds, within), Status::kOutOfRange);
    EXPECT_EQ(broad_phase.report().where, count - 100);
  }
}

TEST_F(GpuBroadPhaseTest, PosesInstancesBitByBitAsTheCpu) {
  GpuBroadPhase broad_phase;
  for (const std::uint32_t count : {1000u, kFewPosed, kFewPosed + 1, kFew, kFewBoxes, kFewBoxes + 1, kMany}) {
    SCOPED_TRACE(count);
    expect_poses_as_the_cpu(broad_phase, count);
  }
  EXPECT_EQ(find_pairs(broad_phase, {}, {}), Status::kOk);
  EXPECT_EQ(broad_phase.report().found, 0u);
}

}  // namespace
}  // namespace tandem
