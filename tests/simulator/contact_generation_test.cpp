#include <algorithm>
#include <cmath>

#include "contact_scene.h"
#include "dynamics/scene_contacts.h"

namespace tandem::test {
namespace {

using dynamics::ContactPoint;

constexpr Vector3 kZ = {0, 0, 1};

// Whether some point lies at `x`, along the plane across `normal`.
bool any_at(const std::vector<ContactPoint>& points, const Vector3& x, double tolerance) {
  return std::any_of(points.begin(), points.end(), [&](const ContactPoint& p) {
    const Vector3 d = p.position - x;
    return norm(d - dot(d, p.normal) * p.normal) <= tolerance;
  });
}

/// Lies on its ridge along y.
Mesh roof() {
  Mesh roof;
  roof.add({0, -0.25f, 0}, {1, -0.25f, 1}, {-1, -0.25f, 1});
  roof.add({0, 0.25f, 0}, {-1, 0.25f, 1}, {1, 0.25f, 1});
  roof.add({0, -0.25f, 0}, {0, 0.25f, 0}, {1, 0.25f, 1});
  roof.add({0, -0.25f, 0}, {1, 0.25f, 1}, {1, -0.25f, 1});
  roof.add({0, 0.25f, 0}, {0, -0.25f, 0}, {-1, -0.25f, 1});
  roof.add({0, 0.25f, 0}, {-1, -0.25f, 1}, {-1, 0.25f, 1});
  roof.add({-1, -0.25f, 1}, {1, -0.25f, 1}, {1, 0.25f, 1});
  roof.add({-1, -0.25f, 1}, {1, 0.25f, 1}, {-1, 0.25f, 1});
  return roof;
}

/// Two bodies, each of a mesh of its own.
ContactScene scene_of(const Mesh& a, const Pose& pose_a, const Mesh& b, const Pose& pose_b) {
  ContactScene scene;
  for (const auto& [mesh, pose] : {std::pair(&a, &pose_a), std::pair(&b, &pose_b)})
    scene.add_body(scene.add_shape(*mesh), *pose);
  return scene;
}

/// There are points, and all have this normal.
void expect_normals(const std::vector<ContactPoint>& points, const Vector3& normal, double tolerance = 1e-9) {
  EXPECT_FALSE(points.empty());
  for (const ContactPoint& p : points) EXPECT_LT(norm(p.normal - normal), tolerance);
}

double deepest_of(const std::vector<ContactPoint>& points) {
  double deepest = 0;
  for (const ContactPoint& p : points) deepest = std::max(deepest, p.depth);
  return deepest;
}

void expect_different_features(const std::vector<ContactPoint>& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) EXPECT_NE(points[i].feature, points[j].feature);
  }
}

// All points have this normal and depth.
void expect_all(const std::vector<ContactPoint>& points, const Vector3& normal, double depth,
                double tolerance) {
  EXPECT_FALSE(points.empty());
  for (const ContactPoint& p : points) {
    EXPECT_LT(norm(p.normal - normal), 1e-9);
    EXPECT_NEAR(p.depth, depth, tolerance);
    EXPECT_LT(p.body_a, p.body_b);
    EXPECT_NE(p.feature, 0u);
  }
}

struct BoxPair {
  double depth, shift_x, shift_y;
  int cells_a, cells_b;
};

void PrintTo(const BoxPair& pair, std::ostream* out) {
  *out << "depth " << pair.depth << ", shift " << pair.shift_x << " " << pair.shift_y << ", cells "
       << pair.cells_a << " on " << pair.cells_b;
}

class BoxOnBox : public testing::TestWithParam<BoxPair> {};

TEST_P(BoxOnBox, HasTheOverlapsCornersItsNormalAndItsDepth) {
  const BoxPair& pair = GetParam();
  ContactScene scene = scene_of(cube(0.5f, pair.cells_a), kIdentityPose, cube(0.5f, pair.cells_b),
                                shift(pair.shift_x, pair.shift_y, 1 - pair.depth));
  RandomPoses random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Pose motion = trial == 0 ? kIdentityPose : any_motion(random, 3);
    const auto points = scene.points(motion);
    expect_all(points, rotate(motion, kZ), pair.depth, 1e-13);
    EXPECT_EQ(points.size(), 4u);
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        const Vector3 corner = {x + (x * pair.shift_x < 0 ? pair.shift_x : 0),
                                y + (y * pair.shift_y < 0 ? pair.shift_y : 0), 0.5 - pair.depth / 2};
        EXPECT_TRUE(any_at(points, apply(motion, corner), 2e-6)) << x << " " << y;
      }
    }
    const double area = (1 - std::fabs(pair.shift_x)) * (1 - std::fabs(pair.shift_y));
    if (trial > 0 && (pair.shift_x == 0 || pair.shift_y == 0)) {
      // Faces in one plane are so no more to the last digit, and whether their triangles meet is chance.
      EXPECT_LT(scene.statistics().area, area + 1e-9);
    } else {
      EXPECT_NEAR(scene.statistics().area, area, 1e-9);
    }
    EXPECT_NEAR(scene.statistics().depth, pair.depth, 1e-13);
    EXPECT_EQ(scene.statistics().counters.manifolds, 1u);
  }
}

// Shifted, side faces of each cut the other's top or bottom; aligned, they lie in one plane.
INSTANTIATE_TEST_SUITE_P(Overlaps, BoxOnBox,
                         testing::Values(BoxPair{1e-6, 0.13, -0.07, 1, 1}, BoxPair{1e-3, 0.13, -0.07, 1, 1},
                                         BoxPair{1e-3, 1e-3, -5e-4, 1, 1}, BoxPair{1e-3, 0.2, 0.1, 4, 4},
                                         BoxPair{1e-3, 0.2, 0.1, 1, 4}, BoxPair{0.04, 0.3, 0.4, 2, 4},
                                         BoxPair{1e-3, 0, 0, 1, 1}, BoxPair{1e-3, 0, 0, 4, 4},
                                         BoxPair{1e-3, 0.25, 0, 4, 2}, BoxPair{1e-3, 0, 0.2, 1, 2}));

TEST(ContactGeneration, BoxesThatTouchExactlyHaveTheCornersOfTheCommonFaceAtDepthZero) {
  for (const auto& [x, y] : {std::pair(0.0, 0.0), std::pair(0.25, 0.0), std::pair(0.125, -0.375)}) {
    for (const int cells : {1, 2, 4}) {
      ContactScene scene;
      const std::uint32_t shape = scene.add_shape(cube(0.5f, cells));
      scene.add_body(shape, kIdentityPose);
      scene.add_body(shape, shift(x, y, 1));
      const auto points = scene.points();
      expect_all(points, kZ, 0, 0);
      EXPECT_EQ(points.size(), 4u);
      EXPECT_NEAR(scene.statistics().area, (1 - std::fabs(x)) * (1 - std::fabs(y)), 1e-12);
      EXPECT_TRUE(any_at(points, Vector3{-0.5 + x, 0.5 + std::min(y, 0.0), 0.5}, 1e-9));
    }
  }
}

TEST(ContactGeneration, NeighboursInAStackPushAlongTheirFacesOnly) {
  // A column of two, one at the side, one on the edge between: overlaps of different sizes each way.
  RandomPoses random(2);
  for (const int cells : {1, 2}) {
    for (int trial = 0; trial < 50; ++trial) {
      ContactScene scene;
      const std::uint32_t shape = scene.add_shape(cube(0.5f, cells));
      const double jitter = trial == 0 ? 0 : 1e-3;
      std::vector<Vector3> middle;
      for (int i = 0; i < 8; ++i) {
        middle.push_back({(i & 1) + random.symmetric(jitter), (i >> 1 & 1) + random.symmetric(jitter),
                          (i >> 2) + random.symmetric(jitter)});
        scene.add_body(shape, shift(middle[i].x, middle[i].y, middle[i].z));
      }
      for (const ContactPoint& p : scene.points()) {
        const Vector3& n = p.normal;
        EXPECT_GT(std::max({std::fabs(n.x), std::fabs(n.y), std::fabs(n.z)}), 1 - 1e-12) << trial;
        EXPECT_GT(dot(p.normal, middle[p.body_b] - middle[p.body_a]), 0.9);
        EXPECT_LE(p.depth, 2 * jitter * 1.001);
      }
    }
  }
}

TEST(ContactGeneration, BodiesThatTouchInAnEdgeOrACornerOfBothHaveNoPointAndAreCounted) {
  for (const double z : {0.0, 1.0}) {
    ContactScene scene = scene_of(cube(0.5f), kIdentityPose, cube(0.5f), shift(1, 1, z));
    EXPECT_TRUE(scene.points().empty());
    EXPECT_GT(scene.triangle_pairs(), 0u);
    EXPECT_EQ(scene.statistics().counters.ambiguous_touches, 1u);
  }
}

TEST(ContactGeneration, ACornerThatTouchesAFaceExactlyHasThatFacesNormal) {
  Mesh tip;  // a pyramid on its tip, above the origin
  tip.add({0, 0, 0}, {-1, 1, 1}, {1, 1, 1});
  tip.add({0, 0, 0}, {1, 1, 1}, {1, -1, 1});
  tip.add({0, 0, 0}, {1, -1, 1}, {-1, -1, 1});
  tip.add({0, 0, 0}, {-1, -1, 1}, {-1, 1, 1});
  tip.add({-1, -1, 1}, {1, -1, 1}, {1, 1, 1});
  tip.add({-1, -1, 1}, {1, 1, 1}, {-1, 1, 1});
  for (const double x : {0.0, 0.125}) {  // on the diagonal between two triangles, and within one
    ContactScene scene = scene_of(cube(0.5f), kIdentityPose, tip, shift(x, 0, 0.5));
    const auto points = scene.points();
    expect_all(points, kZ, 0, 0);
    ASSERT_EQ(points.size(), 1u);
    EXPECT_LT(norm(points[0].position - Vector3{x, 0, 0.5}), 1e-12);
  }
}

TEST(ContactGeneration, AnEdgeThatTouchesAFaceExactlyHasThatFacesNormalAndBothItsEnds) {
  ContactScene scene = scene_of(cube(0.5f), kIdentityPose, roof(), shift(0.125, 0, 0.5));
  const auto points = scene.points();
  expect_all(points, kZ, 0, 0);
  EXPECT_EQ(points.size(), 2u);
  EXPECT_TRUE(any_at(points, Vector3{0.125, -0.25, 0.5}, 1e-12));
  EXPECT_TRUE(any_at(points, Vector3{0.125, 0.25, 0.5}, 1e-12));
}

TEST(ContactGeneration, CrossedEdgesPushAcrossBoth) {
  // Two cubes on edges that cross at a right angle: overlap d along z, a patch of size d.
  for (const double depth : {1e-5, 1e-2}) {
    ContactScene scene;
    const std::uint32_t shape = scene.add_shape(cube(0.5f));
    const double half = std::sqrt(0.5);
    scene.add_body(shape, turn(0, std::atan(1.0)));
    scene.add_body(shape, after(shift(0, 0, 2 * half - depth), turn(1, std::atan(1.0))));
    const auto points = scene.points();
    expect_normals(points, kZ, 1e-6);
    EXPECT_NEAR(deepest_of(points), depth, 1e-6 * depth + 1e-12);
  }
}

// A tip is narrower than it is deep, and has few faces: no reason to push it sideways.
TEST(ContactGeneration, ASharpTipInAFacePushesAlongTheFace) {
  Mesh tip;
  tip.add({0, 0, 0}, {-0.125f, 0.125f, 1}, {0.125f, 0.0625f, 1});
  tip.add({0, 0, 0}, {0.125f, 0.0625f, 1}, {0, -0.125f, 1});
  tip.add({0, 0, 0}, {0, -0.125f, 1}, {-0.125f, 0.125f, 1});
  tip.add({-0.125f, 0.125f, 1}, {0, -0.125f, 1}, {0.125f, 0.0625f, 1});
  for (const bool ground : {true, false}) {
    ContactScene scene = scene_of(ground ? sheet(1, 1) : cube(0.5f), shift(0, 0, ground ? 0 : -0.5), tip,
                                  after(shift(0.1, 0.2, -0.05), turn(0, 0.4)));
    const auto points = scene.points();
    EXPECT_EQ(points.size(), 4u);  // the tip, and three around it, where the depth ends
    expect_normals(points, kZ);
    EXPECT_NEAR(scene.statistics().depth, 0.05, 1e-9);
  }
}

TEST(ContactGeneration, ABoxOnATiltedSheetStandsOnItsFourCorners) {
  const Pose slope = after(turn(2, -0.3), turn(1, 0.35));
  for (const int cells : {1, 7, 40}) {
    for (const double depth : {1e-4, 0.02}) {
      ContactScene scene = scene_of(sheet(4, cells), slope, cube(0.5f),
                                    after(slope, after(shift(0.31, 0.17, 0.5 - depth), turn(2, 0.6))));
      const auto points = scene.points();
      expect_all(points, rotate(slope, kZ), depth, 1e-12);
      EXPECT_EQ(points.size(), 4u) << cells;
      EXPECT_NEAR(scene.statistics().area, 1, 1e-9);
      EXPECT_EQ(scene.statistics().counters.open_curves, 0u);
    }
  }
}

TEST(ContactGeneration, ABoxThatHangsOverASheetsBorderStandsOnTheSheet) {
  ContactScene scene = scene_of(sheet(4, 5), kIdentityPose, cube(0.5f), shift(1.8, 0, 0.49));
  const auto points = scene.points();
  EXPECT_GT(scene.statistics().counters.open_curves, 0u);
  ASSERT_FALSE(points.empty());
  for (const ContactPoint& p : points) {
    EXPECT_LT(norm(p.normal - kZ), 1e-9);
    EXPECT_LE(p.depth, 0.01 + 1e-12);
    EXPECT_LE(p.position.x, 2 + 1e-9);
  }
}

TEST(ContactGeneration, ATiltedBoxIsDeepWhereItsEdgeIs) {
  ContactScene scene;
  scene.add_body(scene.add_shape(sheet(4, 3)), kIdentityPose);
  const double tilt = 0.1, depth = 0.01;  // about the y axis: the edge at +x goes down
  const Pose lean = turn(1, tilt);
  const double lowest = -apply(lean, {0.5, 0, -0.5}).z;
  scene.add_body(scene.add_shape(cube(0.5f)), after(shift(0.1, 0.2, lowest - depth), lean));
  const auto points = scene.points();
  ASSERT_GE(points.size(), 4u);
  const double edge_x = 0.1 + apply(lean, {0.5, 0, -0.5}).x;
  for (const ContactPoint& p : points) {
    EXPECT_LT(norm(p.normal - kZ), 1e-9);
    // The bottom face rises from the edge.
    EXPECT_NEAR(p.depth, std::max(0.0, depth - (edge_x - p.position.x) * std::tan(tilt)), 0.05 * depth);
  }
  EXPECT_NEAR(scene.statistics().depth, depth, 0.05 * depth);
}

TEST(ContactGeneration, SpheresPushAlongTheLineOfTheirMiddlesByTheirOverlap) {
  RandomPoses random(3);
  for (const double overlap : {0.01, 0.1, 0.6}) {
    const Pose turn_a = any_motion(random, 0), turn_b = any_motion(random, 0);
    ContactScene scene =
        scene_of(sphere(1, 5), turn_a, sphere(0.5, 4), after(shift(0, 0, 1.5 - overlap), turn_b));
    const auto points = scene.points();
    expect_normals(points, kZ, 0.03);
    for (const ContactPoint& p : points) EXPECT_GE(p.depth, 0);
    EXPECT_NEAR(deepest_of(points), overlap, 0.006);
    const double height = (1 + (1.5 - overlap) * (1.5 - overlap) - 0.25) / (2 * (1.5 - overlap));
    const double circle = 3.14159265358979323846 * (1 - height * height);
    EXPECT_NEAR(scene.statistics().area, circle, 0.03 * circle + 0.01);
    EXPECT_EQ(scene.statistics().counters.manifolds, 1u);
  }
}

TEST(ContactGeneration, LegsHaveAPatchEach) {
  ContactScene scene;
  const Mesh legs = joined(moved(box(0.2f, 0.2f, 1), -0.5f, 0, 0), moved(box(0.2f, 0.2f, 1), 0.5f, 0, 0));
  scene.add_body(scene.add_shape(cube(2.0f)), kIdentityPose);
  scene.add_body(scene.add_shape(legs), shift(0.03, 0.02, 2.499));
  expect_all(scene.points(), kZ, 1e-3, 1e-12);
  EXPECT_EQ(scene.statistics().counters.manifolds, 2u);
  EXPECT_EQ(scene.statistics().counters.points, 8u);
}

// Where edges cross, the overlap is deepest in the middle, which no edge or vertex names.
TEST(ContactGeneration, PointsOfSeveralPatchesHaveDifferentFeatures) {
  ContactScene scene = scene_of(box(6, 1, 1), turn(0, std::atan(1.0)),
                                joined(moved(roof(), -1.5f, 0, 0), moved(roof(), 1.5f, 0, 0)),
                                shift(0, 0, std::sqrt(0.5) - 0.01));
  const auto points = scene.points();
  EXPECT_EQ(scene.statistics().counters.manifolds, 2u);
  expect_different_features(points);
}

TEST(ContactGeneration, TheCowStandsOnItsFourHooves) {
  for (const char* mesh : {"cow_1500.obj", "cow.obj"}) {
    ContactScene scene = scene_of(sheet(6, 10), kIdentityPose, project_mesh(mesh), shift(0.05, 0.02, -0.004));
    const auto points = scene.points();
    EXPECT_EQ(scene.statistics().counters.manifolds, 4u);
    EXPECT_GE(points.size(), 12u);
    EXPECT_NEAR(scene.statistics().depth, 0.004, 4e-4);
    expect_normals(points, kZ);
  }
}

// A body that went half through a plate is pushed out on the side on which its middle is.
TEST(ContactGeneration, ABodyThatGoesThroughAPlateIsPushedToTheSideOfItsMiddle) {
  for (const double z : {0.3, -0.3}) {
    ContactScene scene = scene_of(box(4, 4, 0.1f), kIdentityPose, sphere(0.5, 3), shift(0.13, 0.07, z));
    const auto points = scene.points();
    ASSERT_FALSE(points.empty());
    for (const ContactPoint& p : points) EXPECT_GT(p.normal.z * (z > 0 ? 1 : -1), 0.99);
  }
}

TEST(ContactGeneration, ABodyWithinAnotherIsNoContact) {
  ContactScene scene = scene_of(cube(0.5f), kIdentityPose, cube(0.2f), shift(0.05, 0, 0));
  EXPECT_TRUE(scene.points().empty());
}

TEST(ContactGeneration, InsideOutMeshesPushTheSameWay) {
  Mesh inside_out = cube(0.5f, 2);
  for (auto& t : inside_out.triangles) std::swap(t[1], t[2]);
  ContactScene scene = scene_of(cube(0.5f), kIdentityPose, inside_out, shift(0.1, 0.2, 0.999));
  expect_all(scene.points(), kZ, 1e-3, 1e-12);
}

// Two cows that overlap in many ways.
ContactScene two_cows(RandomPoses& random, const char* mesh) {
  ContactScene scene;
  const std::uint32_t cow = scene.add_shape(project_mesh(mesh));
  scene.add_body(cow, any_motion(random, 0));
  scene.add_body(cow, any_motion(random, 0.6));
  return scene;
}

TEST(ContactGeneration, PointsMoveWithTheBodies) {
  RandomPoses random(5);
  for (int trial = 0; trial < 20; ++trial) {
    ContactScene scene = two_cows(random, "cow_1500.obj");
    const auto points = scene.points();
    const Pose motion = any_motion(random, 10);
    const auto moved = scene.points(motion);
    ASSERT_EQ(points.size(), moved.size()) << trial;
    for (const ContactPoint& p : points) {
      const bool found = std::any_of(moved.begin(), moved.end(), [&](const ContactPoint& q) {
        return norm(apply(motion, p.position) - q.position) < 1e-7 &&
               norm(rotate(motion, p.normal) - q.normal) < 1e-7 && std::fabs(p.depth - q.depth) < 1e-7 &&
               p.feature == q.feature;
      });
      EXPECT_TRUE(found) << trial;
    }
  }
}

TEST(ContactGeneration, FeaturesLastWhileABoxSettles) {
  ContactScene scene = scene_of(cube(0.5f), kIdentityPose, cube(0.5f), shift(0.1, 0.2, 0.999));
  const auto before = scene.points();
  scene.move_body(1, after(shift(0.1 + 1e-5, 0.2 - 1e-5, 0.9985), turn(0, 1e-6)));
  const auto settled = scene.points();
  ASSERT_EQ(before.size(), settled.size());
  expect_different_features(before);
  for (const ContactPoint& q : before) {
    EXPECT_TRUE(std::any_of(settled.begin(), settled.end(), [&](const ContactPoint& p) {
      return p.feature == q.feature && norm(p.position - q.position) < 1e-3;
    }));
  }
}

// Pushed again and again by what the deepest point says, bodies come apart, however deep they overlap.
TEST(ContactGeneration, PushesLeadOutOfOverlaps) {
  RandomPoses random(6);
  int seen = 0;
  for (int trial = 0; trial < 200; ++trial) {
    ContactScene scene;
    const std::uint32_t ball = scene.add_shape(sphere(0.5, 3)), brick = scene.add_shape(box(1, 0.6f, 0.4f));
    Pose pose = any_motion(random, 0.6);
    scene.add_body(trial % 2 == 0 ? ball : brick, any_motion(random, 0));
    scene.add_body(brick, pose);
    auto points = scene.points();
    if (points.empty()) continue;
    const double first = scene.statistics().depth;
    ++seen;
    int pushes = 0;
    for (; pushes < 20 && scene.statistics().depth > 0.01 * first; ++pushes) {
      const auto deepest =
          std::max_element(points.begin(), points.end(),
                           [](const ContactPoint& p, const ContactPoint& q) { return p.depth < q.depth; });
      const Vector3 push = 1.01 * deepest->depth * deepest->normal;
      pose = after(shift(push.x, push.y, push.z), pose);
      scene.move_body(1, pose);
      points = scene.points();
    }
    EXPECT_LT(pushes, 20) << trial;
    EXPECT_LT(norm(vector_of(pose.translation)), 1.6) << trial;
  }
  EXPECT_GT(seen, 100);
}

// Soups of flat, coincident, huge and tiny triangles make no sense as bodies, and no harm either.
class HostileScene : public testing::TestWithParam<SceneFamily> {};

TEST_P(HostileScene, GivesUnitNormalsAndFiniteDepths) {
  RandomPoses random(12);
  for (int trial = 0; trial < trials(10, 20); ++trial) {
    const BodyScene scene = GetParam().make(random);
    const auto finder = dynamics::make_scene_contacts(scene.assets.views(), 1);
    for (const ContactPoint& p : finder->find(scene.instances, {}, {})) {
      ASSERT_TRUE(dynamics::is_finite(p.position));
      ASSERT_NEAR(norm(p.normal), 1, 1e-9);
      ASSERT_TRUE(p.depth >= 0 && std::isfinite(p.depth)) << p.depth;
    }
    EXPECT_LE(finder->report().contacts.counters.segments, finder->report().counters.contacts);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, HostileScene, testing::ValuesIn(scene_families()),
                         [](const auto& tested) { return std::string(tested.param.name); });

void expect_same_bytes(std::span<const ContactPoint> points, std::span<const ContactPoint> expected) {
  ASSERT_EQ(points.size(), expected.size());
  EXPECT_TRUE(same_bytes(points, expected));
}

TEST(SceneContacts, PairsThatAreKeptHaveNoPointsAndOthersTheSame) {
  SampleAssets assets;
  assets.add(cube(0.5f, 2));
  std::vector<Instance> bodies;
  for (int i = 0; i < 4; ++i) bodies.push_back({0, shift(0.3 * i, 0, 0.99 * i)});
  bodies.push_back({0, shift(2, 0, 0)});  // away from all others
  const auto finder = dynamics::make_scene_contacts(assets.views(), 1);
  const ObjectPair remembered[] = {{0, 4}};
  EXPECT_FALSE(finder->find(bodies, {}, {remembered, 0.001}).empty());
  EXPECT_TRUE(finder->kept().empty());

  for (const std::size_t i : {2, 3}) bodies[i].pose.translation[0] += 0.002;
  const auto rest = finder->find(bodies, {}, {remembered, 0.001});
  const std::vector<ObjectPair> kept = {{0, 1}, {0, 4}, {2, 3}};
  EXPECT_TRUE(std::ranges::equal(finder->kept(), kept));
  EXPECT_EQ(finder->report().kept_pairs, kept.size());
  const auto fresh = dynamics::make_scene_contacts(assets.views(), 1);
  const auto all = fresh->find(bodies, {}, {});
  std::vector<ContactPoint> expected;
  for (const ContactPoint& point : all) {
    if (point.body_a == 1 && point.body_b == 2) expected.push_back(point);
  }
  ASSERT_FALSE(expected.empty());
  ASSERT_LT(expected.size(), all.size());
  expect_same_bytes(rest, expected);
}

TEST(ContactGeneration, ThreadsDoNotChangeAByte) {
  ContactScene scene;
  RandomPoses random(7);
  const std::uint32_t cow = scene.add_shape(project_mesh("cow_1500.obj"));
  for (int i = 0; i < 60; ++i) scene.add_body(cow, any_motion(random, 1.5));
  const auto run = [&](std::uint32_t threads) {
    scene.use_threads(threads);
    return scene.points();
  };
  const auto one = run(1);
  const double area = scene.statistics().area;
  for (const std::uint32_t threads : {2u, 4u}) {
    const auto many = run(threads);
    expect_same_bytes(one, many);
    EXPECT_EQ(area, scene.statistics().area);
  }
}

}  // namespace
}  // namespace tandem::test
