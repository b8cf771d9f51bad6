#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <random>

#include "manifold_scene.h"

namespace tandem::test {
namespace {

// A heap of bodies of many kinds.
void fill(ManifoldScene& scene, std::uint64_t seed, int bodies) {
  RandomPoses random(seed);
  for (const Mesh& mesh : {cube(0.3f, 2), tetrahedron(), sphere(0.4, 2), pipe(12, 0.2, 0.4, 0.4f),
                           sheet(1, 3), project_mesh("cow_1500.obj")}) {
    scene.add_shape(mesh);
  }
  for (int i = 0; i < bodies; ++i)
    scene.add_body(static_cast<std::uint32_t>(random.below(6)), any_motion(random, 1));
}

TEST(ManifoldQuery, TheOrderOfTheContactsDoesNotMatter) {
  ManifoldScene scene;
  fill(scene, 1, 40);
  scene.find();
  const std::vector<Manifold> manifolds(scene.manifolds().begin(), scene.manifolds().end());
  const std::vector<ManifoldPoint> points(scene.points().begin(), scene.points().end());
  const ManifoldCounters counters = scene.made.counters();
  EXPECT_GT(manifolds.size(), 50u);
  std::vector<Contact> contacts(scene.query.rows().begin(), scene.query.rows().end());
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 10; ++trial) {
    std::shuffle(contacts.begin(), contacts.end(), random);
    ASSERT_EQ(scene.made.find(scene.scene, scene.query.pairs(), contacts, {.match_previous = false}),
              Status::kOk);
    EXPECT_TRUE(same_bytes<Manifold>(manifolds, scene.manifolds()));
    EXPECT_TRUE(same_bytes<ManifoldPoint>(points, scene.points()));
    EXPECT_EQ(counters, scene.made.counters());
  }
}

TEST(ManifoldQuery, ThreadsDoNotChangeAByte) {
  ManifoldScene one, many;
  fill(one, 3, 60);
  fill(many, 3, 60);
  RandomPoses random(4);
  for (std::uint32_t threads = 1; threads <= 16; ++threads) {
    for (std::size_t i = 0; i < one.bodies.size(); ++i) {
      for (double& x : one.bodies[i].pose.translation) x += random.symmetric(1e-3);
      many.bodies[i].pose = one.bodies[i].pose;
    }
    EXPECT_EQ(many.scene.set_threads(threads), Status::kOk);
    one.find(kIdentityPose, {});
    many.find(kIdentityPose, {});
    EXPECT_TRUE(same_bytes(one.manifolds(), many.manifolds())) << threads;
    EXPECT_TRUE(same_bytes(one.points(), many.points())) << threads;
    EXPECT_EQ(one.made.counters(), many.made.counters());
    const auto matched = std::count_if(one.points().begin(), one.points().end(),
                                       [](const ManifoldPoint& p) { return p.previous != kNoIndex; });
    EXPECT_EQ(matched > 0, threads > 1);
  }
}

TEST(ManifoldQuery, ManifoldsComeByAscendingPairAndTheirPointsOneAfterTheOther) {
  ManifoldScene scene;
  fill(scene, 5, 40);
  scene.find();
  std::uint32_t next = 0, pair = 0, index = 0;
  for (const Manifold& m : scene.manifolds()) {
    EXPECT_GE(m.pair, pair);
    EXPECT_EQ(m.first_point, next);
    EXPECT_GE(m.point_count, 1u);
    EXPECT_LE(m.point_count, kMostManifoldPoints);
    EXPECT_NEAR(norm(vector_of(m.normal)), 1, 1e-12);
    const ObjectPair& bodies = scene.query.pairs()[m.pair];
    for (const ManifoldPoint& p : scene.points_of(m)) {
      EXPECT_EQ(p.manifold, index);
      EXPECT_NE(p.id, 0u);
      EXPECT_EQ(p.previous, kNoIndex);
      EXPECT_LE(p.depth, m.depth);
      // Half-way between the point on a and that on b, which are the depth apart along the normal.
      const Vector3 on_a = apply(scene.posed[bodies.a].pose, vector_of(p.in_a)),
                    on_b = apply(scene.posed[bodies.b].pose, vector_of(p.in_b)), n = vector_of(m.normal);
      EXPECT_LT(norm(0.5 * (on_a + on_b) - vector_of(p.position)), 1e-12);
      EXPECT_LT(norm(on_a - on_b - p.depth * n), 1e-12);
      EXPECT_LT(p.face_a, scene.assets.mesh(scene.posed[bodies.a].asset).triangles.size());
      EXPECT_LT(p.face_b, scene.assets.mesh(scene.posed[bodies.b].asset).triangles.size());
    }
    pair = m.pair;
    next += m.point_count;
    ++index;
  }
  EXPECT_EQ(next, scene.points().size());
  EXPECT_EQ(scene.made.counters().manifolds, scene.manifolds().size());
  EXPECT_EQ(scene.made.counters().points, scene.points().size());
}

TEST(ManifoldQuery, PointsOnTheSurfacesStayThereWhereMeshesHaveAnOrigin) {
  const std::array<double, 3> origin = {4.5e6, -1e4, 100};
  ManifoldScene scene;
  scene.add_shape(cube(0.5f), origin);
  scene.add_body(0, shift(-origin[0], -origin[1], -origin[2]));
  scene.add_body(0, shift(0.25 - origin[0], 0.125 - origin[1], 0.75 - origin[2]));
  scene.find();
  ASSERT_EQ(scene.points().size(), 4u);
  for (const ManifoldPoint& p : scene.points()) {
    EXPECT_NEAR(p.in_a[2], origin[2] + 0.5, 1e-8);
    EXPECT_NEAR(p.in_b[2], origin[2] - 0.5, 1e-8);
  }
}

/// So far away that corners as far from a plane as triangles are long count as in it: then both triangles at
/// an edge may end a piece there, at two places.
TEST(ManifoldQuery, PointsHaveDifferentIdsWhereRoundingIsAsLargeAsTriangles) {
  RandomPoses random(3);
  ManifoldScene scene;
  scene.add_shape(project_mesh("cow_1500.obj"));
  scene.add_shape(soup(random, 40, 0.3));
  std::size_t points = 0;
  for (int trial = 0; trial < 100; ++trial) {
    scene.bodies.clear();
    for (const std::uint32_t shape : {0u, 1u})
      scene.add_body(shape, after(shift(0, 5e11, -5e11), any_motion(random, 0.3)));
    scene.find();
    std::vector<std::uint64_t> ids;
    for (const ManifoldPoint& p : scene.points()) ids.push_back(p.id);
    std::sort(ids.begin(), ids.end());
    EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end()) << trial;
    points += ids.size();
  }
  EXPECT_GT(points, 800u);
}

// Two bodies that overlap in several places, or not at all.
void throw_cows(ManifoldScene& scene, RandomPoses& random) {
  scene.bodies[0].pose = any_motion(random, 0);
  scene.bodies[1].pose = any_motion(random, 0.6);
}

TEST(ManifoldQuery, FewerPointsMayBeAskedFor) {
  ManifoldScene scene;
  fill(scene, 6, 40);
  scene.find();
  const std::vector<Manifold> all(scene.manifolds().begin(), scene.manifolds().end());
  for (std::uint32_t most = 1; most <= kMostManifoldPoints; ++most) {
    scene.find(kIdentityPose, {.match_previous = false, .most_points = most});
    ASSERT_EQ(all.size(), scene.manifolds().size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Manifold& m = scene.manifolds()[i];
      EXPECT_GE(m.point_count, 1u);
      EXPECT_LE(m.point_count, most);
      EXPECT_EQ(vector_of(m.normal).x, all[i].normal[0]);
    }
  }
}

// A body that is not convex may be deeper beside the line that a quick search takes for the deepest.
TEST(ManifoldQuery, QuickDepthsAreNeverDeeper) {
  RandomPoses random(11);
  ManifoldScene scene;
  scene.add_shape(project_mesh("cow_1500.obj"));
  scene.add_shape(cube(0.3f));
  scene.add_body(0, kIdentityPose);
  scene.add_body(0, kIdentityPose);
  for (const std::uint32_t shape : {0u, 1u}) {
    scene.bodies[0].asset = scene.bodies[1].asset = shape;
    int seen = 0, less_deep = 0;
    for (int trial = 0; trial < trials(60, 20); ++trial) {
      throw_cows(scene, random);
      scene.find();
      const std::vector<Manifold> all(scene.manifolds().begin(), scene.manifolds().end());
      scene.find(kIdentityPose, {.match_previous = false, .quick_depths = true});
      ASSERT_EQ(all.size(), scene.manifolds().size()) << trial;
      for (std::size_t i = 0; i < all.size(); ++i, ++seen) {
        const Manifold& quick = scene.manifolds()[i];
        // Another direction may be the shallowest by depths that are too small.
        if (dot(vector_of(quick.normal), vector_of(all[i].normal)) < 1 - 1e-9) continue;
        EXPECT_LE(quick.depth, all[i].depth * (1 + 1e-5)) << trial;
        less_deep += quick.depth < 0.99 * all[i].depth;
      }
    }
    EXPECT_GT(seen, 10) << shape;
    EXPECT_EQ(less_deep > 0, shape == 0) << less_deep;
  }
}

TEST(ManifoldQuery, AnInstanceWithItselfHasNone) {
  ManifoldScene scene;
  scene.add_shape(joined(cube(0.5f), moved(cube(0.5f), 0.25f, 0.25f, 0.75f)));
  scene.add_body(0, kIdentityPose);
  ASSERT_EQ(scene.scene.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(scene.scene.place(scene.bodies), Status::kOk);
  ASSERT_EQ(scene.query.find(scene.scene, {.self_pairs = true}), Status::kOk);
  ASSERT_FALSE(scene.query.rows().empty());
  ASSERT_EQ(scene.made.find(scene.scene, scene.query), Status::kOk);
  EXPECT_TRUE(scene.manifolds().empty());
  EXPECT_EQ(scene.made.counters().contacts, scene.query.rows().size());
}

struct Seen {
  Vector3 normal, area, centre;
  double depth;
  std::vector<Vector3> points;
};

std::vector<Seen> seen_in(const ManifoldScene& scene) {
  std::vector<Seen> out;
  for (const Manifold& m : scene.manifolds()) {
    out.push_back({vector_of(m.normal), vector_of(m.area_vector), vector_of(m.centre), m.depth, {}});
    for (const ManifoldPoint& p : scene.points_of(m)) out.back().points.push_back(vector_of(p.position));
  }
  return out;
}

bool near(const Vector3& x, const Vector3& y, double tolerance) {
  return norm(x - y) < tolerance;
}

// Whether one of `all` has the normal and the area of this manifold.
bool any_like(const std::vector<Seen>& all, const Seen& wanted, double tolerance) {
  return std::any_of(all.begin(), all.end(), [&](const Seen& s) {
    return near(s.normal, wanted.normal, tolerance) && near(s.area, wanted.area, tolerance);
  });
}

// Returns whether one of them has the same depth, centre and points too, in whatever order.
bool any_same(const std::vector<Seen>& all, const Seen& wanted, double tolerance) {
  return std::any_of(all.begin(), all.end(), [&](const Seen& s) {
    const auto has = [&](const Vector3& x) {
      return std::any_of(s.points.begin(), s.points.end(),
                         [&](const Vector3& y) { return near(x, y, tolerance); });
    };
    return near(s.normal, wanted.normal, tolerance) && near(s.area, wanted.area, tolerance) &&
           near(s.centre, wanted.centre, tolerance) && std::fabs(s.depth - wanted.depth) < tolerance &&
           s.points.size() == wanted.points.size() &&
           std::all_of(wanted.points.begin(), wanted.points.end(), has);
  });
}

TEST(ManifoldQuery, MoveWithTheBodies) {
  RandomPoses random(7);
  ManifoldScene scene;
  scene.add_shape(project_mesh("cow_1500.obj"));
  scene.add_body(0, kIdentityPose);
  scene.add_body(0, kIdentityPose);
  std::size_t seen = 0, same = 0;
  for (int trial = 0; trial < trials(40, 5); ++trial) {
    throw_cows(scene, random);
    scene.find();
    std::vector<Seen> still = seen_in(scene);
    const Pose motion = any_motion(random, 10);
    scene.find(motion);
    const std::vector<Seen> moved = seen_in(scene);
    ASSERT_EQ(still.size(), moved.size()) << trial;
    for (Seen& s : still) {
      s.normal = rotate(motion, s.normal), s.area = rotate(motion, s.area),
      s.centre = apply(motion, s.centre);
      for (Vector3& x : s.points) x = apply(motion, x);
      EXPECT_TRUE(any_like(moved, s, 1e-7)) << trial;
      same += any_same(moved, s, 1e-7);
      ++seen;
    }
  }
  EXPECT_GT(seen, 30u);
  // Rounding decides between points that are equally far out.
  EXPECT_GE(same, seen - seen / 20);
}

TEST(ManifoldQuery, TurnRoundWhereTheBodiesAreExchanged) {
  RandomPoses random(8);
  ManifoldScene scene;
  scene.add_shape(project_mesh("cow_1500.obj"));
  scene.add_body(0, kIdentityPose);
  scene.add_body(0, kIdentityPose);
  std::size_t seen = 0, same = 0;
  for (int trial = 0; trial < trials(40, 5); ++trial) {
    throw_cows(scene, random);
    scene.find();
    std::vector<Seen> before = seen_in(scene);
    std::swap(scene.bodies[0], scene.bodies[1]);
    scene.find();
    const std::vector<Seen> exchanged = seen_in(scene);
    ASSERT_EQ(before.size(), exchanged.size()) << trial;
    for (Seen& s : before) {
      s.normal = -s.normal, s.area = -s.area;
      EXPECT_TRUE(any_like(exchanged, s, 1e-9)) << trial;
      same += any_same(exchanged, s, 1e-9);
      ++seen;
    }
  }
  EXPECT_GT(seen, 30u);
  // Rounding decides between points that are equally far out.
  EXPECT_GE(same, seen - seen / 20);
}

struct Slide {
  const char* name;
  Mesh below, above;
  Pose start;
  Vector3 step;           // a thousandth of the body
  bool one_patch = true;  // else manifolds come, go and merge
};

void PrintTo(const Slide& slide, std::ostream* out) {
  *out << slide.name;
}

class SlidingBody : public testing::TestWithParam<Slide> {};

TEST_P(SlidingBody, ChangesItsManifoldsBySmallStepsAndKeepsTheNamesOfItsPoints) {
  constexpr int kSteps = 300;
  const Slide& slide = GetParam();
  ManifoldScene scene;
  scene.add_body(scene.add_shape(slide.below), kIdentityPose);
  scene.add_body(scene.add_shape(slide.above), slide.start);
  scene.find(kIdentityPose, {});
  ASSERT_FALSE(scene.manifolds().empty());
  const double step = norm(slide.step);
  std::size_t points = 0, kept = 0;
  double most_turn = 0, most_shift = 0, most_deeper = 0;
  for (int i = 0; i < kSteps; ++i) {
    const std::vector<Manifold> manifolds(scene.manifolds().begin(), scene.manifolds().end());
    const std::vector<ManifoldPoint> before(scene.points().begin(), scene.points().end());
    Pose& pose = scene.bodies[1].pose;
    pose.translation[0] += slide.step.x, pose.translation[1] += slide.step.y,
        pose.translation[2] += slide.step.z;
    scene.find(kIdentityPose, {});
    points += scene.points().size();
    std::vector<std::uint64_t> ids;
    for (const ManifoldPoint& p : scene.points()) {
      ids.push_back(p.id);
      if (p.previous == kNoIndex) continue;
      ASSERT_LT(p.previous, before.size());
      const ManifoldPoint& same = before[p.previous];
      EXPECT_EQ(same.id, p.id);
      ++kept;
      const Manifold &now = scene.manifolds()[p.manifold], &then = manifolds[same.manifold];
      most_turn = std::max(most_turn, norm(vector_of(now.normal) - vector_of(then.normal)));
      if (scene.manifolds().size() != manifolds.size()) continue;
      most_shift = std::max(most_shift, norm(vector_of(now.centre) - vector_of(then.centre)) / step);
      most_deeper = std::max(most_deeper, std::fabs(now.depth - then.depth) / step);
    }
    std::sort(ids.begin(), ids.end());
    EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
  }
  const double part = static_cast<double>(kept) / static_cast<double>(points);
  std::printf(
      "%s: %.2f %% of %zu points keep their names; in a step normals turn by %.4f at most, centres move by "
      "%.2f steps, depths by %.3f\n",
      slide.name, 100 * part, points, most_turn, most_shift, most_deeper);
  RecordProperty("kept_percent", std::to_string(100 * part));
  EXPECT_GE(part, 0.95);
  if (!slide.one_patch) return;
  EXPECT_LT(most_turn, 0.05);
  EXPECT_LT(most_shift, 5);
  EXPECT_LT(most_deeper, 2);
}

std::vector<Slide> slides() {
  return {
      {"box_on_sheet", sheet(4, 9), cube(0.5f), after(shift(0.1, 0.2, 0.49), turn(2, 0.4)), {1e-3, 4e-4, 0}},
      {"box_on_box", cube(1), cube(0.5f), shift(0.6, 0.3, 1.499), {1e-3, 3e-4, 0}},
      {"fine_box_on_box",
       cube(1, 5),
       cube(0.5f, 3),
       after(shift(0.1, 0.1, 1.499), turn(2, 0.3)),
       {1e-3, 3e-4, 0}},
      {"tilted_box_on_sheet",
       sheet(4, 9),
       cube(0.5f),
       after(shift(0, 0, 0.52), after(turn(2, 0.5), turn(1, 0.05))),
       {1e-3, 4e-4, 0}},
      {"sphere_on_sheet", sheet(4, 9), sphere(0.5, 3), shift(0.1, 0.2, 0.48), {1e-3, 4e-4, 0}},
      {"sphere_over_sphere", sphere(1, 4), sphere(0.5, 3), shift(0.1, 0.05, 1.4), {1e-3, 0, -2e-4}},
      {"pipe_on_box", cube(1), pipe(16, 0.25, 0.5, 0.5f), shift(0, 0, 1.24), {1e-3, 3e-4, 0}},
      {"cow_on_sheet",
       sheet(6, 10),
       project_mesh("cow_1500.obj"),
       shift(0.05, 0.02, -0.004),
       {1e-3, 3e-4, 0}},
      {"cow_along_cow",
       project_mesh("cow_1500.obj"),
       project_mesh("cow_1500.obj"),
       after(shift(0.2, 0.3, 0.1), turn(2, 0.7)),
       {1e-3, 0, 0},
       false}};
}

INSTANTIATE_TEST_SUITE_P(Pairs, SlidingBody, testing::ValuesIn(slides()),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(ManifoldQuery, WithoutMatchingThereIsNoPreviousPointAndNamesAreThoseOfTheFeatures) {
  ManifoldScene scene;
  scene.add_shape(cube(0.5f));
  scene.add_body(0, kIdentityPose);
  scene.add_body(0, shift(0.1, 0.2, 0.999));
  scene.find();
  const std::vector<ManifoldPoint> first(scene.points().begin(), scene.points().end());
  ASSERT_EQ(first.size(), 4u);
  scene.find();
  EXPECT_TRUE(same_bytes<ManifoldPoint>(first, scene.points()));
  scene.find(kIdentityPose, {});  // nothing before it is remembered
  EXPECT_TRUE(same_bytes<ManifoldPoint>(first, scene.points()));
  scene.find(kIdentityPose, {});
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(scene.points()[i].previous, i);
    EXPECT_EQ(scene.points()[i].id, first[i].id);
  }
  scene.made.forget_points();
  scene.find(kIdentityPose, {});
  EXPECT_TRUE(same_bytes<ManifoldPoint>(first, scene.points()));
}

TEST(ManifoldQuery, PointsAreFoundAgainWhereOtherPairsComeAndGo) {
  ManifoldScene scene;
  scene.add_shape(cube(0.5f));
  for (int i = 0; i < 5; ++i) scene.add_body(0, shift(0.1 * i, 0.05 * i, 0.999 * i));
  scene.find(kIdentityPose, {});
  const std::vector<ManifoldPoint> before(scene.points().begin(), scene.points().end());
  const std::size_t manifolds = scene.manifolds().size();
  scene.bodies[0].pose = shift(10, 0, 0);  // the lowest pair is gone, others move up in the lists
  scene.find(kIdentityPose, {});
  EXPECT_EQ(scene.manifolds().size(), manifolds - 1);
  for (const ManifoldPoint& p : scene.points()) {
    ASSERT_NE(p.previous, kNoIndex);
    EXPECT_EQ(before[p.previous].id, p.id);
    EXPECT_LT(norm(vector_of(before[p.previous].position) - vector_of(p.position)), 1e-12);
  }
}

// Errors.

class WrongInput : public testing::Test {
 protected:
  void SetUp() override {
    scene.add_shape(cube(0.5f));
    scene.add_body(0, kIdentityPose);
    scene.add_body(0, shift(0.1, 0.2, 0.999));
    scene.find();
    contacts.assign(scene.query.rows().begin(), scene.query.rows().end());
    pairs.assign(scene.query.pairs().begin(), scene.query.pairs().end());
    ASSERT_EQ(scene.points().size(), 4u);
  }
  void expect(Status status, std::uint64_t where) {
    EXPECT_EQ(scene.made.find(scene.scene, pairs, contacts), status);
    EXPECT_EQ(scene.scene.where(), where);
    EXPECT_TRUE(scene.manifolds().empty());
    EXPECT_TRUE(scene.points().empty());
    EXPECT_EQ(scene.made.counters(), ManifoldCounters{});
    // Usable again, and remembering nothing.
    scene.find(kIdentityPose, {});
    ASSERT_EQ(scene.points().size(), 4u);
    for (const ManifoldPoint& p : scene.points()) EXPECT_EQ(p.previous, kNoIndex);
  }

  ManifoldScene scene;
  std::vector<ObjectPair> pairs;
  std::vector<Contact> contacts;
};

TEST_F(WrongInput, ContactsThatNameNoPairOrNoTriangleAreRefused) {
  const Contact right = contacts[3];
  contacts[3].pair = 1;
  expect(Status::kUnknownContact, 3);
  contacts[3] = right;
  contacts[3].triangle_a = 12;
  expect(Status::kUnknownContact, 3);
  contacts[3] = right;
  contacts[3].triangle_b = kNoIndex;
  expect(Status::kUnknownContact, 3);
}

TEST_F(WrongInput, PairsThatNameNoInstanceAreRefused) {
  pairs[0].b = 2;
  expect(Status::kUnknownInstance, 0);
}

}  // namespace
}  // namespace tandem::test
