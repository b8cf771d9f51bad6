// The stage for everything that ties: exact where its conditions hold, and the conditions no wider than that.
#include "kernels/geometry/grid_test.h"
#include "kernels/asked.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "kernels/geometry/orientation.h"
#include "kernels/query_scenes.h"

namespace tandem::test {
namespace {

/// Two triangles of integers, times the unit, and where they stand.
struct Integers {
  double unit;
  float a[3][3], b[3][3];
  Pose pose_a, pose_b;
};

/// Holds what the stage is given, made as a query makes it of trees that hold these triangles alone.
struct OnGrid {
  frame::Point<float> a[3], b[3];
  TrianglePair posed;
  bool admitted;

  explicit OnGrid(const Integers& pair) {
    Triangle stored_a{}, stored_b{};
    TreeExtent extent_a{}, extent_b{};
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        stored_a.corner[i].position[k] = pair.a[i][k];
        stored_b.corner[i].position[k] = pair.b[i][k];
        extent_a.reach[k] = std::max(extent_a.reach[k], std::fabs(static_cast<double>(pair.a[i][k])));
        extent_b.reach[k] = std::max(extent_b.reach[k], std::fabs(static_cast<double>(pair.b[i][k])));
      }
      apply(pair.pose_a, pair.a[i][0], pair.a[i][1], pair.a[i][2], posed.a[i]);
      apply(pair.pose_b, pair.b[i][0], pair.b[i][1], pair.b[i][2], posed.b[i]);
    }
    std::copy_n(extent_a.reach, 3, extent_a.half_extent);
    std::copy_n(extent_b.reach, 3, extent_b.half_extent);
    LevelView tree_a{}, tree_b{};
    tree_a.triangle_count = tree_b.triangle_count = 1;
    tree_a.triangles = &stored_a;
    tree_b.triangles = &stored_b;
    RelativePose b_in_a;
    admitted =
        relative_pose(pair.pose_a, extent_a, pair.pose_b, extent_b, b_in_a) == RelativePoseStatus::kOk &&
        lie_on_grid(pair.pose_a, extent_a, grid_of(tree_a, extent_a), pair.pose_b, extent_b,
                    grid_of(tree_b, extent_b), b_in_a);
    for (int i = 0; i < 3; ++i) {
      std::copy_n(pair.a[i], 3, a[i].x);
      std::copy_n(pair.b[i], 3, b[i].x);
      b[i] = frame::posed(b_in_a, b[i]);
    }
  }
};

bool is_flat(const double (&t)[3][3]) {
  for (int k = 0; k < 3; ++k) {
    if (detail::ExactSigns::area(t[0], t[1], t[2], k) != 0) return false;
  }
  return true;
}

int integer(RandomPoses& random, int largest) {
  return static_cast<int>(random.below(2 * static_cast<std::uint64_t>(largest) + 1)) - largest;
}

/// Coordinates up to `largest` in the world, of which many are small or the largest, so that much ties; the
/// same triangles anywhere, as far as float64 has integers, in all units.
Integers random_pair(RandomPoses& random, const int (&largest)[3]) {
  Integers pair;
  pair.unit = std::ldexp(1, integer(random, 30));
  pair.pose_a = quarter_turn(random);
  pair.pose_b = quarter_turn(random);
  const double far = random.below(2) == 0 ? 0 : std::ldexp(1, static_cast<int>(random.below(52)));
  double shift_a[3], shift_b[3];
  // The room of a coordinate, half of D on each side of 0, goes to the triangles or to where they stand.
  const bool shifted = random.below(2) == 0;
  for (int k = 0; k < 3; ++k) {
    pair.pose_a.translation[k] = std::floor(far * random.uniform(0, 0.9));
    shift_a[k] = shifted ? integer(random, largest[k] / 12) : 0;
    shift_b[k] = shifted ? integer(random, largest[k] / 12) : 0;
    pair.pose_b.translation[k] = (pair.pose_a.translation[k] + shift_b[k]) * pair.unit;
    pair.pose_a.translation[k] = (pair.pose_a.translation[k] + shift_a[k]) * pair.unit;
  }
  const std::uint64_t kind = random.below(3), flat_axis = random.below(5);
  const auto fill = [&](float(&t)[3][3], const Pose& pose, const double(&shift)[3]) {
    for (auto& corner : t) {
      double world[3];
      for (int k = 0; k < 3; ++k) {
        const int limit = largest[k] / (shifted ? 4 : 2), small = std::min(limit, 2);
        const bool extreme = kind == 0 || (kind == 1 && random.below(2) == 0);
        const int x = extreme ? (random.below(2) == 0 ? limit : -limit)
                              : integer(random, random.below(2) == 0 ? small : limit);
        world[k] = static_cast<std::uint64_t>(k) == flat_axis ? -shift[k] : x;
      }
      for (int k = 0; k < 3; ++k) {
        double x = 0;
        for (int j = 0; j < 3; ++j) x += pose.rotation[j][k] * world[j];
        corner[k] = static_cast<float>(x * pair.unit);
      }
    }
  };
  fill(pair.a, pair.pose_a, shift_a);
  fill(pair.b, pair.pose_b, shift_b);
  return pair;
}

/// D of the proof along each axis, so that 6 D_0 D_1 D_2 is nearly 2^24: slabs and columns among them.
void random_limits(RandomPoses& random, int (&largest)[3]) {
  double product = 0x1p24 / 6;
  const std::uint64_t first = random.below(3);
  for (std::uint64_t i = 0; i < 3; ++i) {
    const double share = i < 2 ? std::pow(product, random.uniform(0.1, 0.6)) : product;
    const int along = std::max(1, static_cast<int>(share));
    largest[(first + i) % 3] = along;
    product = std::max(1.0, product / along);
  }
}

TEST(GridTest, DecidesAsExactArithmeticWhateverIsNotFlat) {
  RandomPoses random(1);
  long admitted = 0, contacts = 0, decided = 0;
  const int trials = test::trials(200'000, 100);
  for (int i = 0; i < trials; ++i) {
    int largest[3];
    random_limits(random, largest);
    const Integers pair = random_pair(random, largest);
    const OnGrid given(pair);
    if (!given.admitted) continue;
    ++admitted;
    const auto verdicts = frame::decide_on_grid(given.a, given.b);
    const bool exact = decide_exact(given.posed) == Verdict::contact;
    ASSERT_FALSE(verdicts.contact && verdicts.undecided);
    if (verdicts.undecided) {
      ASSERT_TRUE(is_flat(given.posed.a) || is_flat(given.posed.b)) << "trial " << i;
      continue;
    }
    ++decided;
    contacts += exact;
    ASSERT_EQ(verdicts.contact, exact) << "trial " << i;
  }
  std::printf("%ld of %d pairs on a coarse grid, %ld decided, %ld contacts\n", admitted, trials, decided,
              contacts);
  EXPECT_GT(admitted, trials / 2);
  EXPECT_GT(contacts, decided / 10);
  EXPECT_LT(contacts, decided - decided / 10);
}

/// Two triangles with a corner in common, which stand where `far` says.
Integers two_triangles(double unit, double far) {
  Integers pair = {unit, {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}}, {{0, 0, 0}, {3, 0, 1}, {0, 3, 1}}, {}, {}};
  for (auto* t : {&pair.a, &pair.b}) {
    for (auto& corner : *t) {
      for (float& x : corner) x = static_cast<float>(x * unit);
    }
  }
  pair.pose_a = pair.pose_b = kIdentityPose;
  for (int k = 0; k < 3; ++k) pair.pose_a.translation[k] = pair.pose_b.translation[k] = far * unit;
  return pair;
}

TEST(GridTest, AdmitsUnitsAndTranslationsUpToItsLimits) {
  EXPECT_TRUE(OnGrid(two_triangles(1, 0)).admitted);
  EXPECT_TRUE(OnGrid(two_triangles(0x1p-40, 1)).admitted);
  EXPECT_FALSE(OnGrid(two_triangles(0x1p-41, 1)).admitted);
  EXPECT_TRUE(OnGrid(two_triangles(0x1p30, 1)).admitted);
  EXPECT_TRUE(OnGrid(two_triangles(0x1p32, 1)).admitted);  // 12 units of 2^30
  EXPECT_FALSE(OnGrid(two_triangles(0x1p40, 1)).admitted);
  EXPECT_TRUE(OnGrid(two_triangles(1, 0x1p52 - 1)).admitted);
  EXPECT_FALSE(OnGrid(two_triangles(1, 0x1p52 + 1)).admitted);
}

TEST(GridTest, AdmitsCoordinatesUpToTheLimitOfTheirVolumes) {
  // M is 69 and 70 along each axis, D twice that.
  Integers pair = two_triangles(1, 0);
  pair.a[1][0] = pair.a[1][1] = pair.a[1][2] = 69;
  EXPECT_TRUE(OnGrid(pair).admitted);  // 6 * 138^3 = 0.94 * 2^24
  pair.a[1][0] = pair.a[1][1] = pair.a[1][2] = 70;
  EXPECT_TRUE(OnGrid(pair).admitted);  // 6 * 140^3 = 0.98 * 2^24
  pair.a[1][0] = pair.a[1][1] = pair.a[1][2] = 71;
  EXPECT_FALSE(OnGrid(pair).admitted);  // 1.02 * 2^24
}

TEST(GridTest, RefusesWhatIsOffTheGridByALastBit) {
  const Integers pair = two_triangles(0.5, 4);
  ASSERT_TRUE(OnGrid(pair).admitted);
  for (int k = 0; k < 3; ++k) {
    Integers moved = pair;
    moved.pose_b.translation[k] = std::nextafter(moved.pose_b.translation[k], 9);
    EXPECT_FALSE(OnGrid(moved).admitted);
    moved = pair;
    moved.pose_a.translation[k] = 0x1p-1074;
    EXPECT_FALSE(OnGrid(moved).admitted);
    moved = pair;
    moved.pose_a.rotation[k][(k + 1) % 3] = 0x1p-60;
    EXPECT_FALSE(OnGrid(moved).admitted);
    moved = pair;
    moved.pose_b.rotation[k][k] = std::nextafter(1.0, 0.0);
    EXPECT_FALSE(OnGrid(moved).admitted);
    moved = pair;
    moved.b[1][k] = std::nextafter(1.0f, 2.0f);
    EXPECT_FALSE(OnGrid(moved).admitted);
    moved = pair;
    moved.a[1][k] = 0x1p-149f;
    EXPECT_FALSE(OnGrid(moved).admitted);
  }
}

/// A wall along z, and a triangle beside it whose corner p is as near to its plane as integers can be.
Integers beside_a_wall(RandomPoses& random, int largest) {
  const auto up_to = [&](double share) {
    return static_cast<float>(1 + random.below(static_cast<std::uint64_t>(share * largest)));
  };
  const float n = up_to(0.4), height = up_to(0.9), z = std::floor(height / 4);
  const float side =
      random.below(2) == 0 ? 1.0f : -1.0f;  // volumes of (n, n - 1) and (n + 2, n + 1) are -1, 1
  const float x = side > 0 ? n + 2 : n, far = side * std::floor(0.1f * n + 1);
  return {1,
          {{0, 0, 0}, {2 * (n + 1), 2 * n, 0}, {0, 0, height}},
          {{x, x - 1, z}, {x - far, x - 1 + far, z}, {x - far, x - 1 + far, z + 1}},
          kIdentityPose,
          kIdentityPose};
}

struct Errors {
  long admitted = 0, wrong = 0;
};

Errors errors_beside_walls(int largest) {
  RandomPoses random(2);
  Errors out;
  for (int i = 0; i < 100'000; ++i) {
    const OnGrid given(beside_a_wall(random, largest));
    const auto verdicts = frame::decide_on_grid(given.a, given.b);
    out.admitted += given.admitted;
    out.wrong += verdicts.undecided || verdicts.contact != (decide_exact(given.posed) == Verdict::contact);
  }
  return out;
}

/// The limit is needed: among coordinates that are much larger, signs come out wrong.
TEST(GridTest, ErrsOnlyBeyondTheLimit) {
  const Errors within = errors_beside_walls(69), beyond = errors_beside_walls(30'000);
  EXPECT_EQ(within.admitted, 100'000);
  EXPECT_EQ(within.wrong, 0);
  EXPECT_LT(beyond.admitted, 1000);
  EXPECT_GT(beyond.wrong, 100);
}

double grid_of_mesh(const Mesh& mesh) {
  SampleAssets assets;
  assets.add(mesh);
  const LevelView level = assets.views()[0].level();
  return grid_of(level, extent_of(level.blocks[0]));
}

TEST(GridOf, IsTheLargestPowerOfTwoInAllCoordinatesOrNone) {
  EXPECT_EQ(grid_of_mesh(cube(0.5f)), 0.5);
  EXPECT_EQ(grid_of_mesh(cube(0.5f, 8)), 0.125);
  EXPECT_EQ(grid_of_mesh(cube(6)), 2);
  EXPECT_EQ(grid_of_mesh(cube(0x1p-39f)), 0x1p-39);
  EXPECT_EQ(grid_of_mesh(cube(0x1p-41f)), 0);
  EXPECT_EQ(grid_of_mesh(cube(0.3f)), 0);
  RandomPoses random(3);
  EXPECT_EQ(grid_of_mesh(soup(random, 5, 1)), 0);
}

/// Cubes that are turned by quarters and fill space, far from the origin.
BodyScene stack_of_cubes(RandomPoses& random, double far) {
  BodyScene scene;
  scene.assets.add(cube(0.5f, 2));
  for (int i = 0; i < 27; ++i) {
    Pose pose = quarter_turn(random);
    const int place[3] = {i % 3, i / 3 % 3, i / 9};
    for (int k = 0; k < 3; ++k) pose.translation[k] = far + place[k];
    scene.instances.push_back({0, pose});
  }
  return scene;
}

TEST(GridTest, DecidesAllOfAStackOfCubes) {
  RandomPoses random(4);
  const BodyScene scene = stack_of_cubes(random, 1e7);
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(query.find(scene.instances), Status::kOk);
  EXPECT_EQ(query.counters().decided_by_float32, query.counters().candidates);
  EXPECT_EQ(found_contacts(query), all_contacts(scene, false));
  EXPECT_GT(query.rows().size(), 10'000u);
}

/// Faces that part or overlap by a last bit of a coordinate, or by far less, among others that touch.
TEST(GridTest, LeavesToOthersWhatIsMovedByALastBit) {
  RandomPoses random(5);
  for (int trial = 0; trial < trials(20, 20); ++trial) {
    const double far = trial % 3 == 0 ? 0 : trial % 3 == 1 ? 1e7 : 0x1p40;
    BodyScene scene = stack_of_cubes(random, far);
    for (Instance& body : scene.instances) {
      double& x = body.pose.translation[random.below(3)];
      switch (random.below(5)) {
        case 0:
          x = std::nextafter(x, -1e300);
          break;
        case 1:
          x = std::nextafter(x, 1e300);
          break;
        case 2:
          body.pose.rotation[random.below(3)][random.below(3)] += 0x1p-60;
          break;
        default:
          break;
      }
    }
    test::Asked<ContactQuery> query;
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(query.find(scene.instances), Status::kOk);
    EXPECT_EQ(found_contacts(query), all_contacts(scene, false));
    EXPECT_GT(query.counters().decided_by_float32, 0u);
    EXPECT_LT(query.counters().decided_by_float32, query.counters().candidates);
  }
}

}  // namespace
}  // namespace tandem::test
