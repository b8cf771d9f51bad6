#include <algorithm>
#include <cmath>
#include <cstdio>

#include "manifold_scene.h"

/// Manifolds of convex bodies in any pose, beside what the separating axes of the bodies say.
namespace tandem::test {
namespace {

struct Convex {
  const char* name;
  Mesh mesh;
};

void PrintTo(const Convex& convex, std::ostream* out) {
  *out << convex.name;
}

/// A closed solid of four corners.
Mesh thin_tetrahedron(float thickness) {
  Mesh mesh;
  mesh.points = {{1, 0, 0}, {-0.4f, 0.9f, 0}, {-0.5f, -0.8f, 0}, {0, 0, thickness}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  return mesh;
}

/// Two pyramids over a square, base to base.
Mesh lens(float thickness) {
  Mesh mesh;
  mesh.points = {{0.5f, 0, 0},  {0, 0.5f, 0},          {-0.5f, 0, 0},
                 {0, -0.5f, 0}, {0, 0, thickness / 2}, {0, 0, -thickness / 2}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t next = (i + 1) % 4;
    mesh.triangles.push_back({i, next, 4});
    mesh.triangles.push_back({next, i, 5});
  }
  return mesh;
}

const std::vector<Convex>& convex_bodies() {
  static const std::vector<Convex> all = {{"cube", box(1, 1, 1)},
                                          {"fine_cube", cube(0.5f, 3)},
                                          {"box", box(1, 0.7f, 0.3f)},
                                          {"plate", box(1, 1, 1e-2f)},
                                          {"thin_plate", box(1, 1, 1e-4f)},
                                          {"beam", box(2, 0.2f, 0.2f)},
                                          {"tetrahedron", tetrahedron()},
                                          {"thin_tetrahedron", thin_tetrahedron(0.2f)},
                                          {"thinner_tetrahedron", thin_tetrahedron(1e-4f)},
                                          {"lens", lens(0.2f)},
                                          {"thin_lens", lens(1e-3f)},
                                          {"cylinder", regular_prism(12, 0.5, 1)},
                                          {"disc", regular_prism(16, 0.5, 0.05f)},
                                          {"sphere", sphere(0.5, 2)}};
  return all;
}

/// The directions that may part a convex body from another one: normals of its faces, and its edges.
struct Axes {
  std::vector<Vector3> corners, normals, edges;

  explicit Axes(const Mesh& mesh) {
    for (const auto& p : mesh.points) corners.push_back({p[0], p[1], p[2]});
    for (const auto& t : mesh.triangles) {
      const Vector3 &p = corners[t[0]], &q = corners[t[1]], &r = corners[t[2]];
      add(normals, cross(q - p, r - p));
      add(edges, q - p), add(edges, r - q), add(edges, p - r);
    }
  }

 private:
  static void add(std::vector<Vector3>& list, const Vector3& x) {
    const Vector3 e = normalized(x);
    for (const Vector3& known : list) {
      if (norm(known - e) < 1e-7 || norm(known + e) < 1e-7) return;
    }
    list.push_back(e);
  }
};

std::vector<Vector3> turned(const Pose& pose, std::vector<Vector3> list) {
  for (Vector3& x : list) x = rotate(pose, x);
  return list;
}

/// Two posed convex bodies.
class ConvexPair {
 public:
  ConvexPair(const Axes& a, const Pose& pose_a, const Axes& b, const Pose& pose_b) {
    for (const Vector3& x : a.corners) a_.push_back(apply(pose_a, x));
    for (const Vector3& x : b.corners) b_.push_back(apply(pose_b, x));
    const auto of_a = turned(pose_a, a.normals), of_b = turned(pose_b, b.normals);
    for (const auto& list : {of_a, of_b}) {
      for (const Vector3& m : list) add(m);
    }
    const auto edges_a = turned(pose_a, a.edges), edges_b = turned(pose_b, b.edges);
    for (const Vector3& e : edges_a) {
      for (const Vector3& f : edges_b) {
        const Vector3 m = cross(e, f);
        if (norm(m) > 1e-9) add(normalized(m));
      }
    }
  }

  /// The least distance that parts them; negative where they are apart.
  double least() const {
    double out = INFINITY;
    for (const Axis& axis : axes_) out = std::min(out, axis.overlap);
    return out;
  }
  /// How far b is to be moved along n until they are apart.
  double along(const Vector3& n) const {
    double out = INFINITY;
    for (const Axis& axis : axes_) {
      const double part = dot(axis.m, n);
      if (part > 1e-12) out = std::min(out, axis.overlap / part);
    }
    return out;
  }

 private:
  struct Axis {
    Vector3 m;
    double overlap;
  };
  void add(const Vector3& m) {
    for (const Vector3& n : {m, -m}) {
      double highest = -INFINITY, lowest = INFINITY;
      for (const Vector3& x : a_) highest = std::max(highest, dot(n, x));
      for (const Vector3& x : b_) lowest = std::min(lowest, dot(n, x));
      axes_.push_back({n, highest - lowest});
    }
  }

  std::vector<Vector3> a_, b_;
  std::vector<Axis> axes_;
};

bool is_real(const Manifold& m) {
  return (m.flags & kAmbiguous) == 0;
}

class ConvexManifolds : public testing::TestWithParam<Convex> {};

/// Two of the bodies overlap in any way. Other bodies of the list are b.
TEST_P(ConvexManifolds, AreOneForEveryOverlapAndItsDepthPartsTheBodies) {
  RandomPoses random(31);
  int overlaps = 0, several = 0, moved_differently = 0;
  for (const Convex& other : convex_bodies()) {
    const Axes a(GetParam().mesh), b(other.mesh);
    ManifoldScene scene;
    scene.add_body(scene.add_shape(GetParam().mesh), kIdentityPose);
    scene.add_body(scene.add_shape(other.mesh), kIdentityPose);
    for (int trial = 0; trial < trials(60, 20); ++trial) {
      SCOPED_TRACE(std::string(other.name) + " " + std::to_string(trial));
      scene.bodies[0].pose = any_motion(random, 0);
      scene.bodies[1].pose = any_motion(random, std::pow(10, random.uniform(-2, -0.2)));
      const ConvexPair pair(a, scene.bodies[0].pose, b, scene.bodies[1].pose);
      if (pair.least() < 1e-9) continue;
      scene.find();
      if (scene.query.rows().empty()) continue;  // one within the other
      ++overlaps;
      const std::vector<Manifold> manifolds(scene.manifolds().begin(), scene.manifolds().end());
      ASSERT_TRUE(std::any_of(manifolds.begin(), manifolds.end(), is_real)) << pair.least();
      several += manifolds.size() > 1;
      const Manifold& m = *std::find_if(manifolds.begin(), manifolds.end(), is_real);
      const double depth = pair.along(vector_of(m.normal));
      EXPECT_LT(m.depth, depth + 1e-8);
      EXPECT_GT(m.depth, (1 - 1e-5) * depth - 1e-8) << m.flags;
      EXPECT_NEAR(scene.points_of(m)[0].depth, m.depth, 1e-9 * m.depth);
      for (const ManifoldPoint& p : scene.points_of(m)) {
        EXPECT_LT(off_surface(triangles_of(GetParam().mesh, kIdentityPose), vector_of(p.in_a)), 1e-8);
        EXPECT_LT(off_surface(triangles_of(other.mesh, kIdentityPose), vector_of(p.in_b)), 1e-8);
      }
      const Pose motion = any_motion(random, 1);
      scene.find(motion);
      const auto again = scene.manifolds();
      const bool same =
          again.size() == manifolds.size() && std::fabs(again[0].depth - manifolds[0].depth) < 2e-8 &&
          norm(vector_of(again[0].normal) - rotate(motion, vector_of(manifolds[0].normal))) < 1e-7;
      moved_differently += !same;
    }
  }
  RecordProperty("overlaps", overlaps);
  EXPECT_GT(overlaps, 400);
  EXPECT_LE(several, overlaps / 1000);
  EXPECT_LE(moved_differently, 1 + overlaps / 1000);  // thin bodies whose area is rounding, nearly
}

INSTANTIATE_TEST_SUITE_P(Bodies, ConvexManifolds, testing::ValuesIn(convex_bodies()),
                         [](const auto& tested) { return std::string(tested.param.name); });

/// Spheres of triangles are polyhedra: a corner pushes along the face that it is in, which leans, since that
/// parts them soonest.
TEST(Spheres, ThatOverlapALittlePushAlongTheAxisThatPartsThemSoonest) {
  RandomPoses random(33);
  const Mesh mesh = sphere(0.5, 2);
  const Axes axes(mesh);
  ManifoldScene scene;
  scene.add_body(scene.add_shape(mesh), kIdentityPose);
  scene.add_body(0, kIdentityPose);
  for (int trial = 0; trial < trials(60, 20); ++trial) {
    const double overlap = trial % 2 == 0 ? 5e-5 : 5e-4;
    scene.bodies[0].pose = any_motion(random, 0);
    Pose pose = after(shift(0, 0, 0.9), any_motion(random, 0));
    const double apart = ConvexPair(axes, scene.bodies[0].pose, axes, pose).along({0, 0, 1});
    scene.bodies[1].pose = pose = after(shift(0, 0, apart - overlap), pose);
    scene.find();
    ASSERT_EQ(scene.manifolds().size(), 1u);
    const double least = ConvexPair(axes, scene.bodies[0].pose, axes, pose).least();
    EXPECT_LT(scene.manifolds()[0].depth, (trial % 2 == 0 ? 1.001 : 1.01) * least);
  }
}

/// Bodies of bulges and hollows: b stays in contact until it has moved by the depth.
TEST(AnyBodies, DoNotPartBeforeOneHasMovedByTheDepth) {
  RandomPoses random(12);
  const std::vector<Convex> bodies = {{"cow", project_mesh("cow_1500.obj")},
                                      {"ring", ring(24, 0.5, 10, 0.15)},
                                      {"thin_ring", ring(24, 0.5, 8, 0.03)},
                                      {"pipe", pipe(24, 0.3, 0.5, 0.5f)},
                                      {"cube", box(1, 1, 1)},
                                      {"plate", box(2, 2, 0.02f)}};
  int seen = 0, parted = 0;
  for (const Convex& a : bodies) {
    for (const Convex& b : bodies) {
      ManifoldScene scene;
      scene.add_body(scene.add_shape(a.mesh), kIdentityPose);
      scene.add_body(scene.add_shape(b.mesh), kIdentityPose);
      for (int trial = 0; trial < trials(20, 20); ++trial) {
        SCOPED_TRACE(std::string(a.name) + ", " + b.name + " " + std::to_string(trial));
        scene.bodies[0].pose = any_motion(random, 0);
        scene.bodies[1].pose = any_motion(random, std::pow(10, random.uniform(-1, 0.2)));
        scene.find();
        if (scene.query.rows().empty()) continue;
        ASSERT_FALSE(scene.manifolds().empty());
        if (scene.manifolds().size() != 1) continue;
        const Manifold m = scene.manifolds()[0];
        const auto touch_after = [&](double part) {
          std::vector<Instance> posed = scene.posed;
          for (int k = 0; k < 3; ++k) posed[1].pose.translation[k] += part * m.depth * m.normal[k];
          EXPECT_EQ(scene.scene.place(posed), Status::kOk);
          EXPECT_EQ(scene.query.find(scene.scene, {.first_contact_only = true}), Status::kOk);
          return !scene.query.rows().empty();
        };
        EXPECT_TRUE(touch_after(0.999));
        ++seen;
        parted += !touch_after(1.001);  // else the way leads into another part
      }
    }
  }
  EXPECT_GT(seen, 200);
  EXPECT_GT(parted, seen * 7 / 10);
}

/// The tubes of two links are saddles where they meet: neither lies behind the planes of its triangles.
TEST(AnyBodies, LinksOfAChainPartAfterTheDepth) {
  ManifoldScene scene;
  scene.add_body(scene.add_shape(ring(48, 1, 24, 0.25f)), kIdentityPose);
  scene.add_body(0, kIdentityPose);
  for (const double overlap : {0.01, 0.05, 0.1, 0.2}) {
    SCOPED_TRACE(overlap);
    scene.bodies[1].pose = after(shift(1.5 + overlap, 0, 0), turn(0, 1.57079632679489662));
    scene.find();
    ASSERT_EQ(scene.manifolds().size(), 1u);
    EXPECT_LT(scene.manifolds()[0].normal[0], -1 + 1e-6);
    EXPECT_NEAR(scene.manifolds()[0].depth, overlap, 1e-5 * overlap);
  }
}

/// Two bodies whose faces or edges lie in each other.
struct Tie {
  const char* name;
  Mesh a, b;
  Pose pose;
  double depth;  ///< 0: any
};

TEST(Ties, HaveOneManifoldHoweverTheyAreTurned) {
  const std::vector<Tie> ties = {
      {"rod_through_box", box(2, 2, 4), box(1, 4, 1), shift(0.25, 0, 0.75), 1.25},
      {"crossed_beams", box(4, 0.2f, 0.2f), box(0.2f, 4, 0.2f), shift(0, 0, 0), 0.2},
      {"coincident_cubes", box(1, 1, 1), box(1, 1, 1), shift(0, 0, 0), 1},
      {"coincident_fine_cubes", cube(0.5f, 3), cube(0.5f, 3), shift(0, 0, 0), 1},
      {"coincident_spheres", sphere(0.5, 2), sphere(0.5, 2), shift(0, 0, 0), 0},
      {"shifted_spheres", sphere(0.5, 2), sphere(0.5, 2), shift(0.25, 0, 0), 0},
  };
  RandomPoses random(5);
  for (const Tie& tie : ties) {
    ManifoldScene scene;
    scene.add_body(scene.add_shape(tie.a), kIdentityPose);
    scene.add_body(scene.add_shape(tie.b), tie.pose);
    const Axes a(tie.a), b(tie.b);
    for (int trial = 0; trial < trials(100, 30); ++trial) {
      SCOPED_TRACE(std::string(tie.name) + " " + std::to_string(trial));
      scene.find(trial == 0 ? kIdentityPose : any_motion(random, 1));
      ASSERT_EQ(scene.manifolds().size(), 1u);
      const Manifold& m = scene.manifolds()[0];
      const ConvexPair pair(a, scene.posed[0].pose, b, scene.posed[1].pose);
      EXPECT_NEAR(m.depth, pair.along(vector_of(m.normal)), 1e-5 * m.depth);
      if (tie.depth > 0) {
        EXPECT_NEAR(m.depth, tie.depth, 1e-6);
      }
    }
  }
}

TEST(Ties, OfBoxesOnALatticeAreOverlapsOrTouchesAsTheyAre) {
  RandomPoses random(6);
  int overlaps = 0, touches = 0;
  const auto size = [&] { return static_cast<float>(0.5 * static_cast<double>(1 + random.below(4))); };
  const auto place = [&] { return 0.25 * (static_cast<double>(random.below(9)) - 4); };
  for (int trial = 0; trial < trials(1000, 20); ++trial) {
    SCOPED_TRACE(trial);
    const Mesh of_a = box(size(), size(), size()), of_b = box(size(), size(), size());
    ManifoldScene scene;
    scene.add_body(scene.add_shape(of_a), kIdentityPose);
    scene.add_body(scene.add_shape(of_b), shift(place(), place(), place()));
    scene.find(trial % 2 == 0 ? kIdentityPose : any_motion(random, 1));
    if (scene.query.rows().empty()) continue;
    const ConvexPair pair(Axes(of_a), scene.posed[0].pose, Axes(of_b), scene.posed[1].pose);
    const bool touch = pair.least() < 1e-9;
    ++(touch ? touches : overlaps);
    ASSERT_EQ(scene.manifolds().size(), 1u);
    const Manifold& m = scene.manifolds()[0];
    EXPECT_EQ((m.flags & kTouching) != 0, touch);
    EXPECT_NEAR(m.depth, touch ? 0 : pair.along(vector_of(m.normal)), touch ? 0 : 1e-6);
  }
  EXPECT_GT(overlaps, 300);
  EXPECT_GT(touches, 50);
}

/// Bodies whose corners, edges and faces lie in each other's in any way: there lines from the curve may run
/// along faces, or lead out at once.
TEST(Ties, OfConvexBodiesOnALatticeAreOverlapsOrTouchesAsTheyAre) {
  RandomPoses random(2);
  Mesh pyramid = tetrahedron();
  scale(pyramid, 2);
  const std::vector<Mesh> meshes = {box(2, 2, 2),
                                    box(1, 6, 1),
                                    box(2, 2, 0.5f),
                                    cube(1, 2),
                                    pyramid,
                                    sphere(1, 0),
                                    sphere(1, 1),
                                    lens(0.5f),
                                    regular_prism(4, 1, 2),
                                    regular_prism(16, 1, 1),
                                    prism({{-1, -1}, {1, -1}, {-1, 1}}, 1)};
  const auto place = [&] { return 0.25 * (static_cast<double>(random.below(13)) - 6); };
  int overlaps = 0, touches = 0, other_depths = 0;
  for (const Mesh& of_a : meshes) {
    for (const Mesh& of_b : meshes) {
      const Axes a(of_a), b(of_b);
      ManifoldScene scene;
      scene.add_body(scene.add_shape(of_a), kIdentityPose);
      scene.add_body(scene.add_shape(of_b), kIdentityPose);
      for (int trial = 0; trial < trials(20, 20); ++trial) {
        SCOPED_TRACE(std::to_string(&of_a - meshes.data()) + ", " + std::to_string(&of_b - meshes.data()) +
                     " " + std::to_string(trial));
        scene.bodies[0].pose = quarter_turn(random);
        scene.bodies[1].pose = after(shift(place(), place(), place()), quarter_turn(random));
        scene.find(trial % 2 == 0 ? kIdentityPose : any_motion(random, 1));
        if (scene.query.rows().empty()) continue;
        const ConvexPair pair(a, scene.posed[0].pose, b, scene.posed[1].pose);
        const bool touch = pair.least() < 1e-6;
        ++(touch ? touches : overlaps);
        ASSERT_FALSE(scene.manifolds().empty());
        const Manifold& m = *std::max_element(scene.manifolds().begin(), scene.manifolds().end(),
                                              [](const auto& x, const auto& y) { return x.depth < y.depth; });
        if (touch) {
          EXPECT_NEAR(m.depth, 0, 1e-12);
          continue;
        }
        ASSERT_GT(m.depth, 0);
        const double depth = pair.along(vector_of(m.normal));
        other_depths += std::fabs(m.depth - depth) > 1e-5 * depth;
      }
    }
  }
  EXPECT_GT(overlaps, 700);
  EXPECT_GT(touches, 200);
  EXPECT_LE(other_depths, overlaps / 500);
}

/// Found by an audit: two curves of which each was taken for the far side of the other.
TEST(Overlap, OfThinTetrahedraIsNotLost) {
  ManifoldScene scene;
  const std::uint32_t shape = scene.add_shape(thin_tetrahedron(0.2f));
  scene.add_body(shape, kIdentityPose);
  scene.add_body(shape,
                 {{{.245420, -.612815, -.751150}, {-.027853, .770070, -.637351}, {.969017, .177341, .171922}},
                  {.121139, .149780, -.157667}});
  scene.find();
  ASSERT_EQ(scene.query.rows().size(), 8u);
  ASSERT_EQ(scene.manifolds().size(), 1u);
  EXPECT_GT(scene.manifolds()[0].depth, 0);
}

/// A cup, and a ball in it whose lowest point is about as deep as its floor is
/// thick: which way is shorter is a matter of the floor, not of where the cup's middle is.
TEST(Overlap, OfABallWithTheFloorOfACupIsUndoneUpwards) {
  ManifoldScene scene;
  scene.add_body(scene.add_shape(cup(32, 0.1f, 0.2f, 0.01f)), kIdentityPose);
  scene.add_body(scene.add_shape(sphere(0.04, 2)), kIdentityPose);
  for (const double z : {.041, .0395, .036, .030}) {
    SCOPED_TRACE(z);
    scene.bodies[1].pose = shift(.02, .001, z);
    scene.find();
    ASSERT_EQ(scene.manifolds().size(), 1u);
    const Manifold& m = scene.manifolds()[0];
    EXPECT_GT(m.normal[2], 0.99);
    EXPECT_NEAR(m.depth, .05 - z, 0.002);
  }
}

TEST(Points, TheFirstIsTheDeepestHoweverFewAreAskedFor) {
  RandomPoses random(14);
  ManifoldScene scene;
  scene.add_body(scene.add_shape(project_mesh("cow_1500.obj")), kIdentityPose);
  scene.add_body(0, kIdentityPose);
  std::size_t seen = 0;
  for (int trial = 0; trial < trials(30, 10); ++trial) {
    scene.bodies[1].pose = any_motion(random, 0.6);
    for (const std::uint32_t most : {1u, 2u, 4u, 7u}) {
      scene.find(kIdentityPose, {.match_previous = false, .most_points = most});
      for (const Manifold& m : scene.manifolds()) {
        if (m.depth == 0) continue;
        ++seen;
        EXPECT_NEAR(scene.points_of(m)[0].depth, m.depth, 1e-9 * m.depth);
      }
    }
  }
  EXPECT_GT(seen, 50u);
}

}  // namespace
}  // namespace tandem::test
