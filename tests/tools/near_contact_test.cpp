#include "statistics/near_contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <set>

#include "build/sample_asset.h"
#include "bvhbench/pose_work.h"
#include "kernels/asked.h"
#include "parallel/parallel.h"
#include "statistics/statistics.h"

namespace tandem::bench {
namespace {

using test::Bytes;
using test::Mesh;

constexpr Bounds kUnitCube = {{0, 0, 0}, {1, 1, 1}};
const double kRadius = 0.5 * kUnitCube.diagonal();
constexpr Vector kCentre = {0.5, 0.5, 0.5};

// A torus-like ring of triangles, open and far from convex.
Mesh ring(std::uint32_t sides, float offset = 0) {
  Mesh mesh;
  const auto point = [&](std::uint32_t i, float radius, float z) -> std::array<float, 3> {
    const double angle = 6.283185307179586 * i / sides;
    return {offset + radius * static_cast<float>(std::cos(angle)),
            radius * static_cast<float>(std::sin(angle)), z};
  };
  for (std::uint32_t i = 0; i < sides; ++i) {
    mesh.add(point(i, 1, 0), point(i + 1, 1, 0), point(i, 0.7f, 0.3f));
    mesh.add(point(i + 1, 1, 0), point(i + 1, 0.7f, 0.3f), point(i, 0.7f, 0.3f));
  }
  return mesh;
}

struct TestAsset {
  explicit TestAsset(const Mesh& mesh, build::Imaginary imaginary = build::Imaginary::minimal)
      : bytes(test::make_file(mesh, imaginary)) {
    const CheckResult result = bytes.check();
    EXPECT_EQ(result.status, Status::kOk);
    asset = {"test.bvh", result.asset};
  }

  Bytes bytes;
  NamedAsset asset;
};

Vector centre_of_b(const Pose& pose, const Vector& centre = kCentre) {
  Vector at;
  apply(pose, centre[0], centre[1], centre[2], at.data());
  return at;
}

double distance(const Vector& a, const Vector& b) {
  return std::sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                   (a[2] - b[2]) * (a[2] - b[2]));
}

bool same(const Pose& a, const Pose& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

TEST(Random, SkippingGoesOnAsIfDrawn) {
  Random one(7), other(7);
  for (int i = 0; i < 1000; ++i) (void)one.next();
  other.skip(1000);
  EXPECT_EQ(one.next(), other.next());
}

TEST(NearContact, FindsTheOutermostContactAndGoesOnByTheDepth) {
  const NearContactPoses poses(kUnitCube, kUnitCube, 3, PoseSet::training);
  // Two shells around a: the outer one is met first.
  const auto touching = [](const Pose& b) {
    const double at = distance(centre_of_b(b), kCentre);
    return (at <= 0.8 && at >= 0.7) || at <= 0.3;
  };
  for (std::uint64_t i = 0; i < 200; ++i) {
    const auto pose = poses.find(i, touching);
    ASSERT_TRUE(pose);
    EXPECT_TRUE(is_rigid(pose->b));
    EXPECT_GE(pose->depth, 0);
    EXPECT_LT(pose->depth, 0.05);
    const double contact = distance(centre_of_b(pose->b), kCentre) + pose->depth * kRadius;
    EXPECT_LE(contact, 0.8 + 1e-12);
    EXPECT_GT(contact, 0.8 - kRadius / 64 / 65536 - 1e-12);
  }
}

TEST(NearContact, GivesUpWhereNothingTouches) {
  const NearContactPoses poses(kUnitCube, kUnitCube, 3, PoseSet::training);
  int asked = 0;
  EXPECT_FALSE(poses.find(0, [&](const Pose&) { return ++asked < 0; }));
  EXPECT_LT(asked, 100 * 4096);
}

TEST(NearContact, AsksNothingOfBodiesWithoutExtent) {
  const Bounds point = {{1, 2, 3}, {1, 2, 3}};
  EXPECT_FALSE(
      NearContactPoses(point, point, 1, PoseSet::training).find(0, [](const Pose&) { return false; }));
}

TEST(NearContact, SetsAndNumbersAndSeedsGiveOtherPoses) {
  std::set<double> seen;
  std::size_t count = 0;
  for (const std::uint64_t seed : {0u, 1u, 2u}) {
    for (const PoseSet set : {PoseSet::training, PoseSet::validation}) {
      const NearContactPoses poses(kUnitCube, kUnitCube, seed, set);
      for (std::uint64_t i = 0; i < 50; ++i, ++count) {
        seen.insert(poses.find(i, [](const Pose&) { return true; })->b.rotation[0][0]);
      }
    }
  }
  EXPECT_EQ(seen.size(), count);
}

TEST(NearContact, DirectionsAndRotationsAreSpreadEvenly) {
  const NearContactPoses poses(kUnitCube, kUnitCube, 1, PoseSet::validation);
  constexpr int kPoses = 4000;
  Vector direction{}, turned{};
  double squared = 0;
  for (int i = 0; i < kPoses; ++i) {
    const Pose b = poses.find(static_cast<std::uint64_t>(i), [](const Pose&) { return true; })->b;
    const Vector at = centre_of_b(b);
    const double away = distance(at, kCentre);
    for (int k = 0; k < 3; ++k) {
      direction[k] += (at[k] - kCentre[k]) / away / kPoses;
      turned[k] += b.rotation[k][0] / kPoses;
    }
    squared += b.rotation[2][1] * b.rotation[2][1] / kPoses;
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(direction[k], 0, 0.04);  // 4 standard errors
    EXPECT_NEAR(turned[k], 0, 0.04);
  }
  EXPECT_NEAR(squared, 1.0 / 3, 0.02);
}

TEST(NearContact, ASmallBodyMeetsALargeOneAllOver) {
  const Bounds sheet = {{-50, -50, 0}, {50, 50, 0.1}};
  const NearContactPoses poses(sheet, kUnitCube, 1, PoseSet::training);
  int far = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto pose = poses.find(i, [](const Pose& b) { return centre_of_b(b)[2] < 0.5; });
    ASSERT_TRUE(pose);
    const Vector at = centre_of_b(pose->b);
    EXPECT_LE(std::fabs(at[0]), 51);
    far += std::fabs(at[0]) > 25 || std::fabs(at[1]) > 25;
  }
  EXPECT_NEAR(far, 300, 40);
}

TEST(NearContact, PosesDoNotDependOnTheTree) {
  const Mesh mesh = ring(100);
  const TestAsset minimal(mesh), free(mesh, build::Imaginary::free);
  ASSERT_NE(minimal.asset.view.level().block_count, free.asset.view.level().block_count);
  const auto one = make_poses(minimal.asset, minimal.asset, 60, 5, PoseSet::validation);
  const auto other = make_poses(free.asset, free.asset, 60, 5, PoseSet::validation);
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_TRUE(same(one[i].b, other[i].b)) << i;
    EXPECT_EQ(one[i].depth, other[i].depth);
  }
}

TEST(NearContact, BodiesTouchAtFirstContactAndNotJustOutside) {
  const TestAsset body(ring(100));
  const Bounds bounds = bounds_of(body.asset.view);
  const Vector centre = bounds.centre();
  const double radius = 0.5 * bounds.diagonal();
  for (const NearContactPose& found : make_poses(body.asset, body.asset, 60, 1, PoseSet::training)) {
    const Vector at = centre_of_b(found.b, centre);
    const double away = distance(at, centre);
    const auto moved = [&](double outwards) {
      Pose pose = found.b;
      for (int k = 0; k < 3; ++k) pose.translation[k] += outwards * (at[k] - centre[k]) / away;
      return pose;
    };
    const double contact = found.depth * radius;
    const Pose poses[] = {moved(contact - 1e-9), moved(contact + 1.01 * radius / 64 / 65536)};
    const PoseWork work = measure_poses(body.asset, body.asset, poses);
    EXPECT_GT(work.contacts[0], 0u);
    EXPECT_EQ(work.contacts[1], 0u);
  }
}

TEST(PoseWork, DoesNotDependOnThreads) {
  const TestAsset body(ring(300));
  std::vector<Pose> poses;
  for (const auto& pose : make_poses(body.asset, body.asset, 100, 1, PoseSet::training))
    poses.push_back(pose.b);
  const PoseWork all = measure_poses(body.asset, body.asset, poses);
  const parallel::ThreadLimit alone(1);
  const auto again = make_poses(body.asset, body.asset, 100, 1, PoseSet::training);
  for (std::size_t i = 0; i < poses.size(); ++i) EXPECT_TRUE(same(poses[i], again[i].b)) << i;
  EXPECT_EQ(measure_poses(body.asset, body.asset, poses), all);
}

TEST(PoseWork, ExpectedWorkIsThatOfBoxesInTheFirstValidationPoses) {
  const TestAsset body(ring(300, 10));
  const AssetView assets[] = {body.asset.view};
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(assets), Status::kOk);
  constexpr std::uint32_t kPoses = 20;
  double block_pairs = 0, candidates = 0;
  std::vector<Pose> poses;
  for (const auto& pose : make_poses(body.asset, body.asset, kPoses, 1, PoseSet::validation)) {
    poses.push_back(pose.b);
    const Instance instances[] = {{0, kIdentityPose}, {0, pose.b}};
    const ObjectPair pair = {0, 1};
    ASSERT_EQ(query.find(instances, {&pair, 1}, {.mode = QueryMode::boxes}), Status::kOk);
    block_pairs += static_cast<double>(query.counters().block_pairs) / kPoses;
    candidates += static_cast<double>(query.counters().candidates) / kPoses;
  }
  const ExpectedWork work = sample_expected_work(body.asset.view, kPoses);
  EXPECT_EQ(work.poses, kPoses);
  EXPECT_DOUBLE_EQ(work.block_pairs, block_pairs);
  EXPECT_DOUBLE_EQ(work.candidates, candidates);
  const PoseWork measured = measure_poses(body.asset, body.asset, poses);
  ASSERT_TRUE(work.oriented);
  EXPECT_DOUBLE_EQ(work.oriented->block_pairs, spread_of(measured.oriented_block_pairs).mean);
  EXPECT_DOUBLE_EQ(work.oriented->candidates, spread_of(measured.oriented_candidates).mean);
}

TEST(GeometryHash, IsThatOfTheTrianglesInAnyOrder) {
  Mesh mesh = ring(50);
  const TestAsset minimal(mesh), free(mesh, build::Imaginary::free);
  EXPECT_EQ(geometry_hash(minimal.asset.view), geometry_hash(free.asset.view));
  std::swap(mesh.triangles[3], mesh.triangles[40]);
  EXPECT_EQ(geometry_hash(TestAsset(mesh).asset.view), geometry_hash(minimal.asset.view));
  mesh.points[7][1] = std::nextafter(mesh.points[7][1], 9.0f);
  EXPECT_NE(geometry_hash(TestAsset(mesh).asset.view), geometry_hash(minimal.asset.view));
}

TEST(GeometryHash, SeesTheOrigin) {
  TestAsset body(ring(50));
  const std::uint64_t before = geometry_hash(body.asset.view);
  body.bytes.header().origin[2] = 1;
  EXPECT_NE(geometry_hash(body.asset.view), before);
}

TEST(Spread, IsThatOfTheValues) {
  const std::uint32_t values[] = {4, 1, 3, 2};
  const Spread spread = spread_of(values);
  EXPECT_EQ(spread.mean, 2.5);
  EXPECT_DOUBLE_EQ(spread.standard_error, std::sqrt(5.0 / 3 / 4));
  EXPECT_EQ(spread.lower_quartile, 1.75);
  EXPECT_EQ(spread.median, 2.5);
  EXPECT_EQ(spread.upper_quartile, 3.25);
  EXPECT_TRUE(std::isnan(spread_of({values, 1}).standard_error));
}

TEST(Ratio, PairsThePoses) {
  const std::uint32_t base[] = {10, 20, 60}, twice[] = {20, 40, 120}, other[] = {12, 16, 62},
                      none[] = {0, 0, 0};
  EXPECT_EQ(ratio_of(twice, base).value, 2);
  EXPECT_EQ(ratio_of(twice, base).standard_error, 0);
  EXPECT_EQ(ratio_of(other, base).value, 1);
  EXPECT_DOUBLE_EQ(ratio_of(other, base).standard_error, std::sqrt((4 + 16 + 4) / 2.0 / 3) / 30);
  EXPECT_TRUE(std::isnan(ratio_of(base, none).value));
}

}  // namespace
}  // namespace tandem::bench
