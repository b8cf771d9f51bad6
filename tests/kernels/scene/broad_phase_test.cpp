#include "tandem/kernels/broad_phase.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "kernels/common/worker_threads.h"

namespace tandem {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

Pairs brute_force(const std::vector<WorldBox>& boxes) {
  Pairs pairs;
  for (std::uint32_t a = 0; a < boxes.size(); ++a) {
    for (std::uint32_t b = a + 1; b < boxes.size(); ++b) {
      if (overlap(boxes[a], boxes[b])) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

Pairs found(BroadPhase& broad_phase, const std::vector<WorldBox>& boxes) {
  EXPECT_EQ(broad_phase.find_pairs(boxes), Status::kOk);
  Pairs pairs;
  for (const ObjectPair& pair : broad_phase.pairs()) pairs.emplace_back(pair.a, pair.b);
  return pairs;
}

// Boxes of sizes that differ by up to `spread` orders of magnitude, on a grid of `step` so that many touch
// exactly.
std::vector<WorldBox> scattered(std::size_t count, double size, double spread, double step, double offset,
                                std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<WorldBox> boxes(count);
  for (WorldBox& box : boxes) {
    const double edge = size * std::pow(10, -spread * uniform(random));
    for (int k = 0; k < 3; ++k) {
      const double lo = std::round(uniform(random) * 10 / step) * step + offset;
      box.lo[k] = lo;
      box.hi[k] = lo + std::ceil(edge * uniform(random) / step) * step;
    }
  }
  return boxes;
}

TEST(BroadPhase, FindsExactlyThePairsOfBruteForce) {
  BroadPhase broad_phase;
  std::size_t pairs = 0;
  for (const std::size_t count : {0, 1, 2, 3, 4, 5, 16, 17, 65, 1000, 3000}) {
    for (const double step : {1.0, 0.25, 1e-9}) {
      for (const double offset : {0.0, -5.0, 1e7}) {
        const auto boxes = scattered(count, 3, 2, step, offset, count);
        const Pairs expected = brute_force(boxes);
        EXPECT_EQ(found(broad_phase, boxes), expected) << count << " " << step << " " << offset;
        pairs += expected.size();
      }
    }
  }
  EXPECT_GT(pairs, 10000u);
}

TEST(BroadPhase, TakesAHugeBoxAmongSmallOnesAndBoxesInOnePlace) {
  BroadPhase broad_phase;
  auto boxes = scattered(500, 0.1, 1, 1e-3, 0, 1);
  boxes.push_back({{-1e12, -1e12, -1e12}, {1e12, 1e12, 1e12}});
  EXPECT_EQ(found(broad_phase, boxes), brute_force(boxes));
  boxes.assign(200, {{1, 2, 3}, {1, 2, 3}});
  EXPECT_EQ(found(broad_phase, boxes).size(), 200u * 199 / 2);
  boxes.assign(3, {{0, 0, 0}, {0, 0, 0}});
  boxes[1] = {{1e-310, 0, 0}, {1e-310, 0, 0}};
  EXPECT_EQ(found(broad_phase, boxes), (Pairs{{0, 2}}));
}

TEST(BroadPhase, BoxesThatTouchByTheLastBitMeet) {
  BroadPhase broad_phase;
  for (const double x : {1.0, 0.1, 1e7 + 0.1, -3e-200}) {
    const double next = std::nextafter(x, 1e30);
    const std::vector<WorldBox> boxes = {{{x - 1, 0, 0}, {x, 1, 1}},
                                         {{x, 0, 0}, {x + 1, 1, 1}},
                                         {{next, 0, 0}, {x + 1, 1, 1}},
                                         {{x - 1e3, 5, 5}, {x + 1e3, 6, 6}}};
    EXPECT_EQ(found(broad_phase, boxes), (Pairs{{0, 1}, {1, 2}})) << x;
  }
}

TEST(BroadPhase, NamesCoordinatesThatItCannotTake) {
  BroadPhase broad_phase;
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -1e301}) {
    const std::vector<WorldBox> boxes = {{{0, 0, 0}, {1, 1, 1}}, {{0, bad, 0}, {1, 1, 1}}};
    EXPECT_EQ(broad_phase.find_pairs(boxes), Status::kOutOfRange);
    EXPECT_EQ(broad_phase.pairs().size(), 0u);
  }
  WorkerThreads threads;
  ASSERT_TRUE(threads.provide(4));
  for (const std::size_t place : {0, 500, 1999}) {
    auto boxes = scattered(2000, 1, 1, 0.25, 0, place);
    ASSERT_EQ(broad_phase.find_pairs(boxes, {}, true, threads, 4), Status::kOk);
    EXPECT_GE(broad_phase.pairs().size(), boxes.size());
    boxes[place].hi[2] = std::nan("");
    EXPECT_EQ(broad_phase.find_pairs(boxes, {}, true, threads, 4), Status::kOutOfRange) << place;
    EXPECT_EQ(broad_phase.pairs().size(), 0u);
  }
}

/// Boxes of a crowd, a far one, a huge one, and many in one place.
std::vector<std::vector<WorldBox>> hard_boxes() {
  std::vector<std::vector<WorldBox>> all;
  for (const std::size_t count : {0, 1, 2, 63, 129, 700, 3000})
    all.push_back(scattered(count, 1, 1, 0.25, 0, count));
  all.push_back(all.back());
  for (int k = 0; k < 3; ++k) all.back()[5].lo[k] = all.back()[5].hi[k] = 1e299;
  all.push_back(all.back());
  all.back()[9] = {{-1e12, -1e12, -1e12}, {1e12, 1e12, 1e12}};
  all.emplace_back(300, WorldBox{{1, 2, 3}, {1, 2, 3}});
  return all;
}

TEST(BroadPhase, DoesNotDependOnWorkers) {
  BroadPhase alone, together;
  WorkerThreads threads;
  for (const std::vector<WorldBox>& boxes : hard_boxes()) {
    const Pairs expected = found(alone, boxes);
    for (const std::uint32_t workers : {2u, 3u, 4u, 16u, 40u}) {
      ASSERT_TRUE(threads.provide(workers));
      for (const bool self_pairs : {false, true}) {
        ASSERT_EQ(together.find_pairs(boxes, {}, self_pairs, threads, workers), Status::kOk);
        Pairs pairs;
        std::uint32_t selves = 0;
        ObjectPair before = {0, 0};
        for (const ObjectPair& pair : together.pairs()) {
          EXPECT_LE(std::pair(before.a, before.b), std::pair(pair.a, pair.b));
          before = pair;
          if (pair.a == pair.b) {
            EXPECT_EQ(pair.a, selves++);
          } else {
            pairs.emplace_back(pair.a, pair.b);
          }
        }
        EXPECT_EQ(pairs, expected) << boxes.size() << " boxes, " << workers << " workers";
        EXPECT_EQ(selves, self_pairs ? boxes.size() : 0);
        EXPECT_EQ(together.group_pairs(), alone.group_pairs());
      }
    }
  }
}

Pose random_pose(std::mt19937_64& random, double distance) {
  std::normal_distribution<double> normal;
  double q[4], length = 0;
  for (double& x : q) {
    x = normal(random);
    length += x * x;
  }
  for (double& x : q) x /= std::sqrt(length);
  const auto [w, x, y, z] = q;
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}},
          {distance * normal(random), distance * normal(random), distance * normal(random)}};
}

TEST(WorldBoxOf, ContainsEveryPosedCornerAndNoSmallerBoxWould) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (int trial = 0; trial < 20000; ++trial) {
    const Pose pose = random_pose(random, std::pow(10, trial % 12));
    float lower[3], upper[3];
    for (int k = 0; k < 3; ++k) {
      const float a = uniform(random), b = uniform(random);
      lower[k] = std::min(a, b);
      upper[k] = std::max(a, b);
    }
    const WorldBox box = world_box(pose, lower, upper);
    WorldBox corners = {{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
    for (int corner = 0; corner < 8; ++corner) {
      double x[3];
      apply(pose, corner & 1 ? lower[0] : upper[0], corner & 2 ? lower[1] : upper[1],
            corner & 4 ? lower[2] : upper[2], x);
      for (int k = 0; k < 3; ++k) {
        corners.lo[k] = std::min(corners.lo[k], x[k]);
        corners.hi[k] = std::max(corners.hi[k], x[k]);
      }
    }
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(box.lo[k], corners.lo[k]) << trial;
      ASSERT_EQ(box.hi[k], corners.hi[k]) << trial;
    }
    double inside[3];
    const auto between = [&](int k) {
      return lower[k] + (upper[k] - lower[k]) * 0.5f * (1 + uniform(random));
    };
    const float x = between(0), y = between(1), z = between(2);
    if (x < lower[0] || x > upper[0] || y < lower[1] || y > upper[1] || z < lower[2] || z > upper[2])
      continue;
    apply(pose, x, y, z, inside);
    for (int k = 0; k < 3; ++k) ASSERT_TRUE(box.lo[k] <= inside[k] && inside[k] <= box.hi[k]) << trial;
  }
}

TEST(PoseOf, IsRigidOnlyIfItsRotationIs) {
  std::mt19937_64 random(4);
  Pose pose = random_pose(random, 1);
  EXPECT_TRUE(is_rigid(pose));
  pose.rotation[1][2] += 1e-5;
  EXPECT_FALSE(is_rigid(pose));
  Pose mirrored = kIdentityPose;
  mirrored.rotation[0][0] = -1;
  EXPECT_FALSE(is_rigid(mirrored));
  Pose lost = kIdentityPose;
  lost.translation[1] = std::nan("");
  EXPECT_FALSE(is_rigid(lost));
}

// Work counted, not timed: what is far away, or very large, or much denser than the rest, must not spoil the
// order of all others.
TEST(BroadPhase, WorkDoesNotDependOnOutliers) {
  constexpr std::size_t kCount = 20'000;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0, 29);
  std::vector<WorldBox> boxes(kCount);
  for (WorldBox& box : boxes) {
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = uniform(random);
      box.hi[k] = box.lo[k] + 1;
    }
  }
  BroadPhase broad_phase;
  ASSERT_EQ(broad_phase.find_pairs(boxes), Status::kOk);
  const std::uint64_t usual = broad_phase.group_pairs();
  EXPECT_LT(usual, 20 * kCount);
  for (const double far : {1e6, 1e12, 1e299}) {
    std::vector<WorldBox> with_outlier = boxes;
    for (int k = 0; k < 3; ++k) with_outlier[7].lo[k] = with_outlier[7].hi[k] = far;
    ASSERT_EQ(broad_phase.find_pairs(with_outlier), Status::kOk);
    EXPECT_LT(broad_phase.group_pairs(), usual + usual / 2) << far;
    std::vector<WorldBox> two_places = boxes;
    for (std::size_t b = 0; b < kCount; b += 2) {
      two_places[b].lo[0] += far;
      two_places[b].hi[0] += far;
    }
    if (far > 1e15) continue;  // there, boxes of size 1 are points in one place
    ASSERT_EQ(broad_phase.find_pairs(two_places), Status::kOk);
    EXPECT_LT(broad_phase.group_pairs(), usual + usual / 2) << far;
  }
  std::vector<WorldBox> with_ground = boxes;
  with_ground[7] = {{-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9}};
  ASSERT_EQ(broad_phase.find_pairs(with_ground), Status::kOk);
  EXPECT_LT(broad_phase.group_pairs(), 2 * usual);
}

}  // namespace
}  // namespace tandem
