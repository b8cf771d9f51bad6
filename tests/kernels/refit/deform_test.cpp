// Tests scenes whose assets deform, against brute force on the positions and against trees built anew.
#include <gtest/gtest.h>

#include <algorithm>

#include "bent_mesh.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/impact_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/moved_query.h"
#include "tandem/kernels/tolerance_query.h"

namespace tandem::test {
namespace {

/// Bodies whose positions are kept beside them, so that anybody can say what touches.
struct BentScene {
  std::vector<Mesh> meshes;
  std::vector<Positions> positions;
  std::vector<std::unique_ptr<Bytes>> files;
  std::vector<Instance> instances;
  Scene scene;
  ContactQuery query;

  void add(const Mesh& mesh) {
    meshes.push_back(welded(mesh));
    positions.push_back(positions_of(meshes.back()));
    files.push_back(std::make_unique<Bytes>(make_refittable_file(meshes.back())));
  }

  void set_assets() {
    std::vector<AssetView> views;
    for (const auto& file : files) views.push_back(file->check().asset);
    ASSERT_EQ(scene.set_assets(views), Status::kOk);
  }

  void place() { ASSERT_EQ(scene.place(instances), Status::kOk); }

  void deform(std::uint32_t asset, const Positions& now, bool in_float32) {
    if (in_float32) {
      const std::vector<float> rounded = single(now);
      for (std::size_t i = 0; i < now.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) positions[asset][i][k] = static_cast<double>(rounded[3 * i + k]);
      }
      ASSERT_EQ(scene.deform(asset, rounded), Status::kOk);
    } else {
      positions[asset] = now;
      ASSERT_EQ(scene.deform(asset, flat(now)), Status::kOk);
    }
  }

  PosedTriangle posed(std::uint32_t body, std::uint32_t face) const {
    const Pose& pose = instances[body].pose;
    PosedTriangle out;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& v = positions[instances[body].asset][meshes[instances[body].asset].triangles[face][c]];
      for (std::size_t k = 0; k < 3; ++k) {
        const double* const r = pose.rotation[k];
        const double x = r[0] * v[0], y = r[1] * v[1], z = r[2] * v[2], xy = x + y, xyz = xy + z;
        out[c][k] = xyz + pose.translation[k];
      }
    }
    return out;
  }

  /// What touches, by exact arithmetic on all pairs of triangles.
  FaceContacts all(bool selves) const {
    FaceContacts out;
    for (std::uint32_t a = 0; a < instances.size(); ++a) {
      for (std::uint32_t b = selves ? a : a + 1; b < instances.size(); ++b) {
        const auto faces_a = static_cast<std::uint32_t>(meshes[instances[a].asset].triangles.size());
        const auto faces_b = static_cast<std::uint32_t>(meshes[instances[b].asset].triangles.size());
        for (std::uint32_t i = 0; i < faces_a; ++i) {
          const PosedTriangle of_a = posed(a, i);
          for (std::uint32_t j = a == b ? i + 1 : 0; j < faces_b; ++j) {
            if (decide_exact(pair_of(of_a, posed(b, j))) == Verdict::contact) out.push_back({a, b, i, j});
          }
        }
      }
    }
    return out;
  }

  FaceContacts found(const ContactOptions& options = {}) {
    EXPECT_EQ(query.find(scene, options), Status::kOk);
    FaceContacts out;
    for (const Contact& contact : query.rows()) {
      const ObjectPair pair = query.pairs()[contact.pair];
      const bool turned = pair.a == pair.b && contact.face_a > contact.face_b;
      out.push_back({pair.a, pair.b, turned ? contact.face_b : contact.face_a,
                     turned ? contact.face_a : contact.face_b});
    }
    std::sort(out.begin(), out.end());
    return out;
  }
};

/// Three deforming bodies and a rigid one, at random poses near each other.
void fill(BentScene& of, RandomPoses& random) {
  of.add(sheet(2, 4));
  of.add(cube(0.75f, 2));
  of.add(random_mesh(40, random.engine()()));
  of.add(sphere(0.8, 2));
  of.set_assets();
  for (std::uint32_t asset = 0; asset < 4; ++asset) {
    Pose pose = any_rotation(random);
    for (double& t : pose.translation) t = random.symmetric(0.8);
    of.instances.push_back({asset, pose});
  }
  of.place();
}

TEST(Deform, ContactsAreThoseOfThePositions) {
  RandomPoses random(11);
  std::size_t contacts = 0;
  for (int trial = 0; trial < trials(12, 20); ++trial) {
    BentScene of;
    fill(of, random);
    for (int step = 0; step < 8; ++step) {
      const auto asset = static_cast<std::uint32_t>(random.below(3));
      const Bend bend = kBends[random.below(std::size(kBends))];
      of.deform(asset, bent(bend, random.symmetric(2), positions_of(of.meshes[asset]), random),
                random.below(2) == 0);
      const bool selves = random.below(2) == 0;
      const FaceContacts expected = of.all(selves);
      contacts += expected.size();
      ASSERT_EQ(of.found({.self_pairs = selves}), expected) << trial << " " << step;
    }
  }
  EXPECT_GT(contacts, 10000u);
}

// The same mesh at the same positions, as an asset of its own.
TEST(Deform, AnswersAreThoseOfATreeBuiltAnew) {
  RandomPoses random(12);
  for (int trial = 0; trial < trials(30, 20); ++trial) {
    BentScene of, anew;
    fill(of, random);
    for (std::uint32_t asset = 0; asset < 3; ++asset) {
      const Bend bend = kBends[random.below(std::size(kBends) - 2)];
      of.deform(asset, bent(bend, random.symmetric(2), positions_of(of.meshes[asset]), random), true);
    }
    for (std::uint32_t asset = 0; asset < 4; ++asset) {
      Mesh mesh = of.meshes[asset];
      for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) mesh.points[i][k] = static_cast<float>(of.positions[asset][i][k]);
      }
      anew.add(mesh);
    }
    anew.set_assets();
    anew.instances = of.instances;
    anew.place();
    for (const double within : {0.0, 0.05, 0.5})
      ASSERT_EQ(of.found({.within = within}), anew.found({.within = within}));
    for (const QueryMode mode : {QueryMode::fast, QueryMode::boxes}) {
      const FaceContacts expected = of.all(false), got = of.found({.mode = mode});
      if (mode == QueryMode::boxes) {
        ASSERT_TRUE(std::includes(got.begin(), got.end(), expected.begin(), expected.end()));
      }
    }
    DistanceQuery x, y;
    ASSERT_EQ(x.find(of.scene), Status::kOk);
    ASSERT_EQ(y.find(anew.scene), Status::kOk);
    ASSERT_EQ(x.rows().size(), y.rows().size());
    for (std::size_t i = 0; i < x.rows().size(); ++i)
      ASSERT_TRUE(x.rows()[i].lower <= y.rows()[i].upper && y.rows()[i].lower <= x.rows()[i].upper) << i;
  }
}

TEST(Deform, DistancesOfFloat64PositionsAreCertified) {
  BentScene of;
  of.add(sheet(2, 3));
  of.add(sheet(2, 3));
  of.set_assets();
  of.instances = {{0, kIdentityPose}, {1, kIdentityPose}};
  of.place();
  Positions raised = of.positions[1];
  for (auto& p : raised) p[2] = 1 + 0x1p-40;
  of.deform(1, raised, false);
  DistanceQuery query;
  ASSERT_EQ(query.find(of.scene, {.tolerance = {0, 1e-14}}), Status::kOk);
  ASSERT_EQ(query.rows().size(), 1u);
  EXPECT_LE(query.rows()[0].lower, 1 + 0x1p-40);
  EXPECT_GE(query.rows()[0].upper, 1 + 0x1p-40);
  EXPECT_GT(query.rows()[0].lower, 1 + 0x1p-41);
  // Clearance is decided on the numbers themselves: closed, and no wider.
  EXPECT_FALSE(of.found({.within = 1 + 0x1p-40}).empty());
  EXPECT_TRUE(of.found({.within = 1 + 0x1p-41}).empty());
}

TEST(Deform, ABodyMovesBeforeAndAfter) {
  RandomPoses random(13);
  BentScene of;
  fill(of, random);
  for (int step = 0; step < 40; ++step) {
    const auto body = static_cast<std::uint32_t>(random.below(4));
    if (random.below(2) == 0) {
      Pose pose = any_rotation(random);
      for (double& t : pose.translation) t = random.symmetric(1.5);
      of.instances[body].pose = pose;
      if (random.below(3) == 0) {
        of.place();
      } else {
        ASSERT_EQ(of.scene.move(body, pose), Status::kOk);
      }
    } else {
      of.deform(body,
                bent(kBends[random.below(8)], random.symmetric(2), positions_of(of.meshes[body]), random),
                random.below(2) == 0);
    }
    ASSERT_EQ(of.found(), of.all(false)) << step;
  }
}

TEST(Deform, AllBodiesOfAnAssetBend) {
  BentScene of;
  of.add(cube(0.5f, 1));
  of.set_assets();
  Pose right = kIdentityPose;
  right.translation[0] = 1.5;
  of.instances = {{0, kIdentityPose}, {0, right}};
  ASSERT_EQ(of.scene.place(of.instances, {}), Status::kOk);
  EXPECT_TRUE(of.found().empty());
  Positions wide = of.positions[0];
  for (auto& p : wide) p[0] *= 2;
  of.deform(0, wide, true);
  EXPECT_EQ(of.found(), of.all(false));
  EXPECT_FALSE(of.found().empty());
}

TEST(Deform, AFixedBodyThatBendsIsFoundWhereItIs) {
  BentScene of;
  for (int i = 0; i < 40; ++i) of.add(cube(0.5f, 1));
  of.set_assets();
  std::vector<Motion> motion(40, Motion::fixed);
  motion[0] = Motion::moving;
  for (std::uint32_t i = 0; i < 40; ++i) {
    Pose pose = kIdentityPose;
    pose.translation[0] = 3.0 * i;
    of.instances.push_back({i, pose});
  }
  PairFilter filter;
  filter.motion = motion.data();
  ASSERT_EQ(of.scene.place(of.instances, filter), Status::kOk);
  EXPECT_TRUE(of.found().empty());
  Positions wide = of.positions[30];
  for (auto& p : wide) p[0] = 200 * p[0] - 100;
  of.deform(30, wide, true);
  ASSERT_FALSE(of.found().empty());
  for (const FaceContact& contact : of.found()) EXPECT_TRUE(contact.a == 0 && contact.b == 30);
}

TEST(Deform, WhatIsKeptOfPairsThatBentIsNot) {
  BentScene of;
  of.add(cube(0.5f, 1));
  of.add(cube(0.5f, 1));
  of.add(cube(0.5f, 1));
  of.set_assets();
  for (std::uint32_t i = 0; i < 3; ++i) {
    Pose pose = kIdentityPose;
    pose.translation[0] = 0.9 * i;
    of.instances.push_back({i, pose});
  }
  of.place();
  MovedQuery moved;
  const auto kept = [&] {
    EXPECT_EQ(moved.find(of.scene, {.tolerance = 1e-3}), Status::kOk);
    return moved.pairs().size() - moved.rows().size();
  };
  EXPECT_EQ(kept(), 0u);
  EXPECT_EQ(kept(), 2u);
  of.deform(2, of.positions[2], true);
  EXPECT_EQ(kept(), 1u);
  EXPECT_EQ(kept(), 2u);
}

TEST(Deform, ManifoldsContainmentAndImpactsAreOfThePositions) {
  BentScene of;
  of.add(cube(0.5f, 2));
  of.add(cube(0.5f, 2));
  of.set_assets();
  Pose above = kIdentityPose;
  above.translation[2] = 1.25;
  of.instances = {{0, kIdentityPose}, {1, above}};
  of.place();
  Positions tall = of.positions[0];
  for (auto& p : tall) p[2] = p[2] > 0 ? 0.8125 : p[2];  // its top is then 0.0625 in the other
  of.deform(0, tall, true);
  ManifoldQuery manifolds;
  ASSERT_EQ(of.query.find(of.scene), Status::kOk);
  ASSERT_EQ(manifolds.find(of.scene, of.query), Status::kOk);
  ASSERT_EQ(manifolds.rows().size(), 1u);
  EXPECT_NEAR(manifolds.rows()[0].normal[2], 1, 1e-12);
  EXPECT_NEAR(manifolds.rows()[0].depth, 0.0625, 1e-12);
  Positions small = of.positions[0];
  for (auto& p : small) p = {0.25 * p[0], 0.25 * p[1], 0.25 * p[2] + 1.25};
  of.deform(0, small, true);
  ContainmentQuery contained;
  ASSERT_EQ(of.query.find(of.scene), Status::kOk);
  ASSERT_EQ(contained.find(of.scene, of.query), Status::kOk);
  ASSERT_EQ(contained.rows().size(), 1u);
  EXPECT_EQ(contained.rows()[0].inner, 0u);
  of.deform(0, positions_of(of.meshes[0]), true);
  ImpactQuery impacts;
  std::vector<RigidMotion> motions(2);
  motions[1].velocity[2] = -1;
  ASSERT_EQ(impacts.find(of.scene, {.motion = motions, .duration = 1}), Status::kOk);
  ASSERT_EQ(impacts.rows().size(), 1u);
  EXPECT_NEAR(impacts.rows()[0].t_safe, 0.25, 1e-5);
}

TEST(Deform, WhatIsNotOfferedIsNamed) {
  BentScene of;
  of.add(cube(0.5f, 1));
  of.add(cube(0.5f, 1));
  of.set_assets();
  of.instances = {{0, kIdentityPose}, {1, kIdentityPose}};
  of.place();
  ManifoldQuery manifolds;
  ContainmentQuery contained;
  ImpactQuery impacts;
  ToleranceQuery tolerance;
  const std::vector<RigidMotion> motions(2);
  const auto expect = [&](Status status, Status of_tolerance) {
    ASSERT_EQ(of.query.find(of.scene), Status::kOk);
    EXPECT_EQ(manifolds.find(of.scene, of.query), status);
    EXPECT_EQ(contained.find(of.scene, of.query), status);
    EXPECT_EQ(impacts.find(of.scene, {.motion = motions, .duration = 1}), status);
    EXPECT_EQ(tolerance.find(of.scene), of_tolerance);
  };
  expect(Status::kOk, Status::kOk);
  of.deform(1, of.positions[1], true);
  expect(Status::kOk, Status::kDeformed);
  EXPECT_EQ(of.scene.where(), 1u);
  Positions third = of.positions[1];
  third[3][1] = 1.0 / 3;
  of.deform(1, third, false);
  expect(Status::kNotFloat32, Status::kDeformed);
  of.deform(1, of.positions[0], false);  // float32 numbers again
  expect(Status::kOk, Status::kDeformed);
}

TEST(Deform, ErrorsChangeNothing) {
  const Mesh mesh = welded(cube(0.5f, 1));
  const Bytes file(make_refittable_file(mesh)), without(make_file(mesh));
  const AssetView views[2] = {file.check().asset, without.check().asset};
  Scene scene;
  std::vector<float> positions = single(positions_of(mesh));
  EXPECT_EQ(scene.deform(0, positions), Status::kUnknownAsset);
  ASSERT_EQ(scene.set_assets(views), Status::kOk);
  EXPECT_EQ(scene.deform(2, positions), Status::kUnknownAsset);
  EXPECT_EQ(scene.where(), 2u);
  EXPECT_EQ(scene.deform(1, positions), Status::kNoSourceVertices);
  EXPECT_EQ(scene.where(), 1u);
  EXPECT_EQ(scene.deform(0, std::span(positions).first(21)), Status::kVertexCountMismatch);
  EXPECT_EQ(scene.where(), 7u);
  EXPECT_EQ(scene.deform(0, std::span(positions).first(23)), Status::kVertexCountMismatch);
  Pose far = kIdentityPose;
  far.translation[0] = 0.9e300;
  const Instance instances[2] = {{0, kIdentityPose}, {0, far}};
  ASSERT_EQ(scene.place(instances), Status::kOk);
  positions[16] = NAN;
  EXPECT_EQ(scene.deform(0, positions), Status::kOutOfRange);
  EXPECT_EQ(scene.where(), 5u);
  ContactQuery query;
  const ObjectPair self = {0, 0};
  ASSERT_EQ(query.find(scene, std::span(&self, 1), {}), Status::kOk);
  EXPECT_EQ(scene.looseness(0), 1);
  const std::size_t before = query.rows().size();
  positions[16] = 0;
  ASSERT_EQ(scene.deform(0, positions), Status::kOk);
  ASSERT_EQ(scene.set_assets(views), Status::kOk);  // as the files have them again
  ASSERT_EQ(scene.place(instances), Status::kOk);
  ASSERT_EQ(query.find(scene, std::span(&self, 1), {}), Status::kOk);
  EXPECT_EQ(query.rows().size(), before);
}

/// Counts the block pairs at which two such bodies look that stand a little apart from each other.
std::uint64_t block_pairs(const AssetView& view, const std::vector<float>* positions, double& looseness) {
  Scene scene;
  EXPECT_EQ(scene.set_assets({{view}}), Status::kOk);
  if (positions != nullptr) {
    EXPECT_EQ(scene.deform(0, *positions), Status::kOk);
  }
  looseness = scene.looseness(0);
  Pose beside = kIdentityPose;
  beside.translation[0] = 0.11, beside.translation[1] = 0.07, beside.translation[2] = 0.05;
  const Instance instances[2] = {{0, kIdentityPose}, {0, beside}};
  EXPECT_EQ(scene.place(instances), Status::kOk);
  ContactQuery query;
  EXPECT_EQ(query.find(scene), Status::kOk);
  return query.counters().block_pairs;
}

TEST(Deform, ALooseTreeTakesMoreBlockPairsThanOneOfThePositions) {
  const Mesh round = welded(sphere(1, 4));
  const Bytes at_rest(make_refittable_file(round));
  double loosenesses[2], ratios[2];
  for (std::size_t twisted = 0; twisted < 2; ++twisted) {
    Mesh mesh = round;  // an ellipse along z, whose upper end turns by three turns more than the lower one
    for (auto& [x, y, z] : mesh.points) {
      const float angle = twisted != 0 ? 9.4f * z : 0, c = std::cos(angle), s = std::sin(angle), px = x;
      x = c * px - 0.2f * s * y;
      y = s * px + 0.2f * c * y;
    }
    const std::vector<float> positions = single(positions_of(mesh));
    const auto refitted =
        static_cast<double>(block_pairs(at_rest.check().asset, &positions, loosenesses[twisted]));
    const Bytes built(make_refittable_file(mesh));
    double of_built;
    ratios[twisted] = refitted / static_cast<double>(block_pairs(built.check().asset, nullptr, of_built));
    EXPECT_EQ(of_built, 1);
  }
  EXPECT_TRUE(loosenesses[0] < 1.75 && ratios[0] < 1.2) << loosenesses[0] << " " << ratios[0];
  EXPECT_TRUE(loosenesses[1] > 1.75 && ratios[1] > 1.2) << loosenesses[1] << " " << ratios[1];
}

}  // namespace
}  // namespace tandem::test
