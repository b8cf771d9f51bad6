// Blocks in frames of their own: what the proof in docs/oriented_box_test.md says of each step.
#include "tandem/formats/oriented_block.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "kernels/random_rotation.h"
#include "kernels/tolerance/sure_verdicts.h"

namespace tandem::test {
namespace {

constexpr Real kU = 0x1p-24L;

std::int64_t squared_length(const Quaternion& q) {
  std::int64_t sum = 0;
  for (const std::int64_t part : q) sum += part * part;
  return sum;
}

// The frame is whole numbers, n times a rotation, and no reflection.
void expect_exact_rotation(const Quaternion& q) {
  const BlockFrame frame = frame_of(packed(q));
  std::int64_t m[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      m[i][k] = static_cast<std::int64_t>(frame.scaled[i][k]);
      ASSERT_EQ(static_cast<float>(m[i][k]), frame.scaled[i][k]);
    }
  }
  const std::int64_t n = squared_length(q);
  for (int j = 0; j < 3; ++j) {
    for (int k = 0; k < 3; ++k) {
      std::int64_t columns = 0, rows = 0;
      for (int i = 0; i < 3; ++i) columns += m[i][j] * m[i][k], rows += m[j][i] * m[k][i];
      ASSERT_EQ(columns, j == k ? n * n : 0);
      ASSERT_EQ(rows, j == k ? n * n : 0);
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
      ASSERT_EQ(m[j1][k1] * m[j2][k2] - m[j1][k2] * m[j2][k1], n * m[j][k]);
    }
  }
  ASSERT_LE(std::fabs(static_cast<Real>(frame.inverse_length) * static_cast<Real>(n) - 1), 2 * kU);
}

// x' of q x conjugated(q), for x along axis k: n times the frame's axis.
void expect_axes_of_quaternion(const Quaternion& q) {
  const BlockFrame frame = frame_of(packed(q));
  const std::int64_t w = q[0], v[3] = {q[1], q[2], q[3]};
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 3; ++i) {
      const std::int64_t cross = i == k ? 0 : (i + 1) % 3 == k ? -v[3 - i - k] : v[3 - i - k];  // (v x e_k)_i
      const std::int64_t diagonal = i == k ? 2 * w * w - squared_length(q) : 0;
      ASSERT_EQ(static_cast<std::int64_t>(frame.scaled[i][k]), diagonal + 2 * v[i] * v[k] + 2 * w * cross);
    }
  }
}

TEST(BlockFrame, IsExactlyARotationTimesAWholeNumber) {
  for (int i = 1; i < 7 * 7 * 7 * 7; ++i) {
    const Quaternion q = {i % 7 - 3, i / 7 % 7 - 3, i / 49 % 7 - 3, i / 343 - 3};
    if (squared_length(q) == 0) continue;
    ASSERT_NO_FATAL_FAILURE(expect_exact_rotation(q));
    ASSERT_NO_FATAL_FAILURE(expect_axes_of_quaternion(q));
  }
  RandomPoses random(1);
  for (std::uint64_t i = hundredth_of(20'000'000); i > 0; --i) {
    const Quaternion q = random_quaternion(random);
    ASSERT_NO_FATAL_FAILURE(expect_exact_rotation(q));
    ASSERT_NO_FATAL_FAILURE(expect_axes_of_quaternion(q));
  }
}

TEST(BlockRotation, KeepsAQuaternionOfWholeNumbers) {
  RandomPoses random(2);
  for (int i = 0; i < 100'000; ++i) {
    Quaternion q = random_quaternion(random);
    q[random.below(4)] = random.below(2) == 0 ? kLargestQuaternionPart : -kLargestQuaternionPart;
    const float size = std::exp2(static_cast<float>(random.below(200)) - 120);
    const BlockRotation r = rotation_near(size * static_cast<float>(q[0]), size * static_cast<float>(q[1]),
                                          size * static_cast<float>(q[2]), size * static_cast<float>(q[3]));
    ASSERT_EQ(unpacked(r), q);
  }
  EXPECT_EQ(unpacked(kNoRotation), (Quaternion{kLargestQuaternionPart, 0, 0, 0}));
}

// Three parts off by half a unit of 2047 at most; angles between rotations are twice those of quaternions.
TEST(BlockRotation, IsWithinAThousandthOfWhatWasAskedFor) {
  constexpr double kBound = 2 * 0.8667 / kLargestQuaternionPart;
  RandomPoses random(3);
  double worst = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    float part[4];
    for (float& p : part) p = static_cast<float>(random.symmetric(1) * (random.below(4) == 0 ? 1e-3 : 1));
    const Quaternion q = unpacked(rotation_near(part[0], part[1], part[2], part[3]));
    double asked = 0, got = 0, across = 0;
    for (int k = 0; k < 4; ++k) {
      asked += static_cast<double>(part[k]) * part[k];
      got += static_cast<double>(q[k]) * q[k];
      for (int l = 0; l < k; ++l) {
        const double area = static_cast<double>(part[k]) * q[l] - static_cast<double>(part[l]) * q[k];
        across += area * area;
      }
    }
    worst = std::max(worst, 2 * std::asin(std::sqrt(across / (asked * got))));
  }
  std::printf("largest angle %.2e, bound %.2e\n", worst, kBound);
  EXPECT_LE(worst, kBound);
  EXPECT_GT(worst, 0.5 * kBound);
}

// The frame's coordinates of a point, with an error below 2^-61 of its distance from the origin.
Real along(const BlockFrame& frame, int k, const float (&vertex)[3]) {
  Real sum = 0, squared = 0;
  for (int i = 0; i < 3; ++i) {
    sum += static_cast<Real>(frame.scaled[i][k]) * vertex[i];  // exact: 48 bits
    squared += static_cast<Real>(frame.scaled[i][k]) * frame.scaled[i][k];
  }
  return sum / std::sqrt(squared);
}

Real length(const float (&vertex)[3]) {
  return std::sqrt(static_cast<Real>(vertex[0]) * vertex[0] + static_cast<Real>(vertex[1]) * vertex[1] +
                   static_cast<Real>(vertex[2]) * vertex[2]);
}

void random_vertex(RandomPoses& random, const Scale& scale, const Direction& centre, float (&vertex)[3]) {
  for (int i = 0; i < 3; ++i) vertex[i] = static_cast<float>(centre[i] + random.symmetric(scale.size));
}

TEST(BlockBox, ContainsItsVerticesAndReachesNoFartherThanTheProofSays) {
  RandomPoses random(4);
  Real worst_along = 0, worst_reach = -1;
  for (std::uint64_t trial = hundredth_of(50'000'000); trial > 0; --trial) {
    const Scale scale = any_scale(random);
    const BlockRotation rotation = packed(random_quaternion(random));
    const ScaledRotation scaled = scaled_rotation(rotation);
    const BlockFrame frame = any_frame_of(rotation, random);
    Direction centre;
    for (Real& x : centre) x = random.symmetric(scale.centre);
    float vertex[4][3];
    const auto count = 1 + random.below(4);
    Real farthest = 0;
    const Direction axis = axes_of(frame)[0];
    const Real on_axis = random.below(4) == 0 ? random.symmetric(scale.size) : 0;  // reaches farthest
    for (std::uint64_t v = 0; v < count; ++v) {
      random_vertex(random, scale, centre, vertex[v]);
      for (int i = 0; i < 3 && on_axis != 0; ++i) vertex[v][i] = static_cast<float>(axis[i] * on_axis);
      farthest = std::max(farthest, length(vertex[v]));
    }
    const auto rounded_up = static_cast<double>(farthest * (1 + 0x1p-52L));
    const Real tiny = 0x1p-149L;  // float32 ends there
    for (int k = 0; k < 3; ++k) {
      double lowest = HUGE_VAL, highest = -HUGE_VAL;
      for (std::uint64_t v = 0; v < count; ++v) {
        const double at = along_axis(scaled, k, vertex[v]);
        const Real error = std::fabs(at - along(frame, k, vertex[v]));
        ASSERT_LE(error, 0x1p-51L * length(vertex[v]));
        if (error > 0) worst_along = std::max(worst_along, error / (0x1p-51L * length(vertex[v])));
        lowest = std::min(lowest, at), highest = std::max(highest, at);
      }
      float c, h;
      box_along(lowest, highest, rounded_up, c, h);
      for (std::uint64_t v = 0; v < count; ++v) {
        const Real off = std::fabs(along(frame, k, vertex[v]) - c);  // the second term: its own error
        ASSERT_LE(off + 0x1p-60L * farthest, h);
      }
      const Real reach = std::fabs(static_cast<Real>(c)) + h;
      ASSERT_LE(reach, farthest * (1 + 0x1p-20L) + 2 * tiny);
      if (farthest > 0x1p-100L) worst_reach = std::max(worst_reach, (reach / farthest - 1) * 0x1p20L);
    }
  }
  std::printf("largest errors, of what is promised: along_axis %.3f, reach %.3f\n",
              static_cast<double>(worst_along), static_cast<double>(worst_reach));
}

struct Poses {
  RelativePose b_in_a;
  TreeExtent a, b;
};

// Makes poses of trees that reach as far as `scale` says. Returns false if they are out of range.
bool relate(RandomPoses& random, const Scale& scale, Poses& out) {
  for (TreeExtent* extent : {&out.a, &out.b}) {
    for (int k = 0; k < 3; ++k) {
      extent->half_extent[k] = random.uniform(0, scale.size);
      extent->reach[k] = extent->half_extent[k] + random.uniform(0, scale.centre);
    }
  }
  Pose a = random.pose(scale), b = random.pose(scale);
  for (int k = 0; k < 3; ++k)
    b.translation[k] = a.translation[k] + random.symmetric(2 * (scale.size + scale.centre));
  return relative_pose(a, out.a, b, out.b, out.b_in_a) == RelativePoseStatus::kOk;
}

// The largest errors found, in units of their bounds.
struct Worst {
  Real row = 0, column = 0, translation = 0, translation_length = 0, back_translation = 0;
};

void note(Real& worst, Real error, Real bound) {
  ASSERT_LE(error, bound * 1.0001L);  // of second order
  worst = std::max(worst, error / bound);
}

Real length(const Direction& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

void compare_pose(const RelativePose& given, const BlockFrame& frame_a, const BlockFrame& frame_b,
                  Worst& worst) {
  const OrientedPose pose = oriented_pose(given.rotation, given.translation, 0, frame_a, frame_b);
  const auto p = axes_of(frame_a), r = axes_of(frame_b);
  Direction rotation[3]{}, off[3]{}, t{}, off_t{};
  Real mu_squared = 1, given_length = 0;
  for (int j = 0; j < 3; ++j) {
    Real sum = 0;
    for (int k = 0; k < 3; ++k) {
      Real of_columns = 0;
      for (int i = 0; i < 3; ++i)
        of_columns += static_cast<Real>(given.rotation[i][j]) * given.rotation[i][k];
      sum += std::fabs(of_columns);
    }
    mu_squared = std::max(mu_squared, sum);
  }
  const Real mu = std::sqrt(mu_squared);
  for (const float x : given.translation) given_length += static_cast<Real>(x) * x;
  given_length = std::sqrt(given_length);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) t[i] += p[i][k] * given.translation[k];
    off_t[i] = pose.translation[i] - t[i];
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) {
        for (int l = 0; l < 3; ++l) rotation[i][j] += p[i][k] * given.rotation[k][l] * r[j][l];
      }
      off[i][j] = pose.rotation[i][j] - rotation[i][j];
    }
  }
  const Real tiny = 0x1p-96L;  // below the normal range
  for (int i = 0; i < 3; ++i) {
    note(worst.row, length(off[i]), 20.3L * kU * mu);
    note(worst.column, length(Direction{off[0][i], off[1][i], off[2][i]}), 16.5L * kU * mu);
    note(worst.translation, std::fabs(off_t[i]), 6.1L * kU * given_length + tiny);
    Real back = pose.back_translation[i];
    for (int k = 0; k < 3; ++k) back += rotation[k][i] * t[k];
    note(worst.back_translation, std::fabs(back), 27.9L * kU * mu * given_length + tiny);
  }
  note(worst.translation_length, length(off_t), 8.3L * kU * given_length + tiny);
}

TEST(OrientedPose, IsWithinTheBoundsOfTheProof) {
  RandomPoses random(5);
  Worst worst;
  std::uint64_t made = 0;
  const std::uint64_t count = hundredth_of(50'000'000);
  for (std::uint64_t i = 0; i < count; ++i) {
    Poses poses;
    if (!relate(random, any_scale(random), poses)) continue;
    ++made;
    const BlockFrame a = any_frame_of(packed(random_quaternion(random)), random),
                     b = any_frame_of(packed(random_quaternion(random)), random);
    ASSERT_NO_FATAL_FAILURE(compare_pose(poses.b_in_a, a, b, worst)) << "trial " << i;
  }
  std::printf("largest errors, of their bounds: rows %.2f, columns %.2f, T %.2f and %.2f, T' %.2f\n",
              static_cast<double>(worst.row), static_cast<double>(worst.column),
              static_cast<double>(worst.translation), static_cast<double>(worst.translation_length),
              static_cast<double>(worst.back_translation));
  EXPECT_GT(made, count / 2);
  EXPECT_GT(worst.row, 0.1);  // else the poses are not hard
}

// This holds where trees may meet, that is where they are not far apart.
TEST(OrientedSlack, IsSomeMillionthsOfTheReachAtOrdinaryPoses) {
  RandomPoses random(6);
  double largest = 0;
  for (int i = 0; i < 100'000; ++i) {
    Scale scale;
    scale.size = std::exp2(random.uniform(-40, 40));
    scale.centre = scale.translation = scale.size;
    Poses poses;
    ASSERT_TRUE(relate(random, scale, poses));
    double reach_a = 0, reach_b = 0, t = 0;
    for (int k = 0; k < 3; ++k) {
      reach_a += poses.a.reach[k] * poses.a.reach[k];
      reach_b += poses.b.reach[k] * poses.b.reach[k];
      t += std::pow(static_cast<double>(poses.b_in_a.translation[k]), 2);
    }
    if (std::sqrt(t) > std::sqrt(reach_a) + std::sqrt(reach_b)) continue;
    const float slack = oriented_slack(poses.b_in_a, poses.a, poses.b);
    largest = std::max(largest, slack / std::sqrt(std::max(reach_a, reach_b)));
  }
  std::printf("largest slack %.2e of the reach\n", largest);
  EXPECT_GT(largest, 0);
  EXPECT_LT(largest, 1.5e-5);
}

TEST(OrientedBlocks, ImaginaryOnesOverlapNothing) {
  constexpr Box kImaginary = {{kImaginaryCentre, kImaginaryCentre, kImaginaryCentre},
                              {kImaginaryHalfExtent, kImaginaryHalfExtent, kImaginaryHalfExtent}};
  RandomPoses random(7);
  std::uint64_t with_zeros = 0;
  for (int i = 0; i < 100'000; ++i) {
    Poses poses;
    const Scale scale = any_scale(random);
    if (!relate(random, scale, poses)) continue;
    const OrientedPose pose = oriented_pose(
        poses.b_in_a.rotation, poses.b_in_a.translation, oriented_slack(poses.b_in_a, poses.a, poses.b),
        frame_of(packed(random_quaternion(random))), frame_of(packed(random_quaternion(random))));
    with_zeros += pose.rotation[0][0] == 0 || pose.rotation[0][1] == 0;
    Position lo, hi;
    const Box real = random.box(scale, lo, hi);
    const float far = 0x1p121f;
    const Box large = {{0, 0, 0}, {far, far, far}};
    for (const Box& box : {real, large, kImaginary}) {
      ASSERT_FALSE(overlap_oriented(box, kImaginary, pose));
      ASSERT_FALSE(overlap_oriented(kImaginary, box, pose));
    }
    ASSERT_TRUE(overlap_oriented(large, large, pose));
  }
  EXPECT_GT(with_zeros, 1000u);  // where the product with infinity is none
}

}  // namespace
}  // namespace tandem::test
