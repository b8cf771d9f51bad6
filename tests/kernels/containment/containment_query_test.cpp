// Bodies within bodies, on the CPU.
#include <gtest/gtest.h>

#include "containment_scenes.h"
#include "gpu/made_files.h"
#include "kernels/contact/contact_query_fixture.h"
#include "kernels/geometry/inside_test.h"

namespace tandem {

std::ostream& operator<<(std::ostream& out, const Containment& row) {
  return out << "(pair " << row.pair << ", inner " << row.inner << ", component " << row.component
             << ", flags " << row.flags << ')';
}

namespace {

using test::all_contained;
using test::cube;
using test::every_pair;
using test::Mesh;
using test::PartedMesh;
using test::PartedScene;
using Rows = std::vector<Containment>;

class Containments : public testing::Test {
 protected:
  Rows find(const BodyScene& scene, const std::vector<ObjectPair>& pairs, std::uint32_t threads = 1) {
    EXPECT_EQ(scene_.set_threads(threads), Status::kOk);
    EXPECT_EQ(scene_.set_assets(scene.assets.views()), Status::kOk);
    EXPECT_EQ(scene_.place(scene.instances), Status::kOk);
    EXPECT_EQ(contacts_.find(scene_, pairs, {}), Status::kOk);
    EXPECT_EQ(query_.find(scene_, contacts_), Status::kOk);
    return {query_.rows().begin(), query_.rows().end()};
  }
  Rows find(const BodyScene& scene) { return find(scene, every_pair(scene, true)); }

  Scene scene_;
  ContactQuery contacts_;
  ContainmentQuery query_;
};

PartedMesh solid(const Mesh& mesh) {
  PartedMesh out;
  out.add(mesh);
  return out;
}

PartedMesh shell(float outer, float inner) {
  PartedMesh out;
  out.add(cube(outer));
  out.add(cube(inner), {}, true);
  return out;
}

TEST_F(Containments, OfNestedBodiesEachLiesInAllAroundIt) {
  PartedScene nest;
  nest.add(solid(cube(1)));
  nest.add(solid(cube(2)));
  nest.add(solid(cube(4)));
  nest.scene.instances = {{0, at(0, 0, 0)}, {1, at(0.5, 0, 0)}, {2, at(0, 0.5, 0)}, {0, at(20, 0, 0)}};
  EXPECT_EQ(find(nest.scene, {{0, 1}, {2, 0}, {1, 2}, {0, 3}, {3, 2}, {0, 0}}),
            (Rows{{0, 0, 0, kInside}, {1, 1, 0, kInside}, {2, 0, 0, kInside}}));
}

TEST_F(Containments, AHollowIsOutsideAndAWallIsInside) {
  PartedScene nest;
  nest.add(shell(4, 2));
  nest.add(solid(cube(0.5f)));
  nest.scene.instances = {
      {0, at(0, 0, 0)}, {1, at(0, 0, 0)}, {1, at(3, 0, 0)}, {1, at(2, 0, 0)}, {1, at(4, 0, 0)}};
  EXPECT_EQ(find(nest.scene, {{0, 1}, {0, 2}, {0, 3}, {0, 4}}), (Rows{{1, 1, 0, kInside}}));
}

TEST_F(Containments, AComponentCountsThatTouchesNothingWhateverTheOthersDo) {
  PartedScene nest;
  nest.add(solid(cube(4)));
  PartedMesh three;
  three.add(cube(0.5f));
  three.add(cube(0.5f), {4, 0, 0});  // across the wall
  three.add(cube(0.5f), {8, 0, 0});
  nest.add(three);
  nest.scene.instances = {{0, at(0, 0, 0)}, {1, at(0, 0, 0)}};
  const Rows rows = find(nest.scene, {{0, 1}});
  EXPECT_EQ(rows, all_contained(nest, {{0, 1}}));
  EXPECT_EQ(rows.size(), 1u);
}

TEST_F(Containments, AnOpenBodyIsSaidToBeOpen) {
  PartedScene nest;
  PartedMesh open;
  open.add(cube(4), {}, false, true);
  nest.add(open);
  nest.add(solid(cube(0.5f)));
  open.add(cube(1));  // a closed part within an open one still encloses
  nest.add(open);
  nest.scene.instances = {
      {0, at(0, 0, 0)}, {1, at(0, 0, 0)}, {1, at(2, 2, 2)}, {1, at(9, 0, 0)}, {2, at(0, 0, 0)}};
  EXPECT_EQ(find(nest.scene, {{0, 1}, {2, 0}, {0, 3}, {4, 1}, {4, 2}}), (Rows{{0, 1, 0, kOuterOpen},
                                                                              {1, 0, 0, kOuterOpen},
                                                                              {3, 1, 0, kInside | kOuterOpen},
                                                                              {4, 1, 0, kOuterOpen}}));
}

TEST_F(Containments, AreThoseOfBruteForce) {
  std::size_t inside = 0, open = 0, touching = 0;
  for (int i = 0; i < test::trials(150, 20); ++i) {
    SCOPED_TRACE(i);
    RandomPoses random(static_cast<std::uint64_t>(i));
    const double far = i % 5 == 4 ? std::pow(10.0, static_cast<double>(i % 9)) : 0;
    const PartedScene scene = test::nest(random, i % 2 == 0, far);
    const auto pairs = every_pair(scene.scene);
    const Rows expected = all_contained(scene, pairs);
    ASSERT_EQ(find(scene.scene, pairs), expected);
    touching += contacts_.rows().size();
    for (const Containment& row : expected) {
      inside += (row.flags & kInside) != 0;
      open += (row.flags & kOuterOpen) != 0;
    }
  }
  EXPECT_GT(inside, 100u);
  EXPECT_GT(open, 100u);
  EXPECT_GT(touching, 100u);
}

TEST_F(Containments, AreFoundUnderTheDeepestTree) {
  RandomPoses random(3);
  const PartedScene scene = test::deep_nest(random);
  const auto pairs = every_pair(scene.scene);
  const Rows expected = all_contained(scene, pairs);
  EXPECT_GE(expected.size(), 3u);
  EXPECT_EQ(find(scene.scene, pairs), expected);
}

TEST_F(Containments, DoNotDependOnTheNumberOfThreads) {
  const PartedScene crowd = test::crowded_nest(7, 48);
  const auto pairs = every_pair(crowd.scene);
  const Rows one = find(crowd.scene, pairs);
  EXPECT_GT(one.size(), 10u);
  for (std::uint32_t threads = 2; threads <= 16; ++threads) EXPECT_EQ(find(crowd.scene, pairs, threads), one);
}

// A cube whose vertices are on a grid, from all points of a finer grid that are not on it: rays along edges,
// along faces and through vertices.
TEST(RayCrosses, AnOddNumberOfTrianglesFromInside) {
  for (int cells = 1; cells <= 2; ++cells) {
    const Mesh mesh = cube(1, cells);
    for (int x = -6; x <= 6; ++x) {
      for (int y = -6; y <= 6; ++y) {
        for (int z = -6; z <= 6; ++z) {
          const double p[3] = {0.25 * x, 0.25 * y, 0.25 * z};
          const double reach = std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])});
          if (reach == 1) continue;
          bool odd = false;
          for (const auto& corners : mesh.triangles) {
            double t[3][3];
            for (std::size_t i = 0; i < 3; ++i) {
              for (std::size_t k = 0; k < 3; ++k) t[i][k] = mesh.points[corners[i]][k];
            }
            odd = odd != containment::ray_crosses(t, p);
          }
          ASSERT_EQ(odd, reach < 1) << p[0] << ' ' << p[1] << ' ' << p[2];
        }
      }
    }
  }
}

// Tilted by so little that float64 cannot tell the planes from the points: the ray starts before or behind
// it.
TEST(RayCrosses, WhatIsAheadByOneUnitInTheLastPlace) {
  const double t[3][3] = {{1, -1, -1}, {1, 3, -1}, {1, -1, 3}};
  for (const double factor : {1.0, 1e100, 1e-100, 1e250, 1e-310}) {
    double scaled[3][3], tilted[3][3];
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) scaled[i][k] = tilted[i][k] = factor * t[i][k];
    }
    tilted[1][0] = std::nextafter(factor, 2 * factor);
    const double on[3] = {factor, 0, 0}, before[3] = {std::nextafter(factor, 0), 0, 0};
    EXPECT_TRUE(containment::ray_crosses(scaled, before)) << factor;
    EXPECT_FALSE(containment::ray_crosses(scaled, on)) << factor;
    EXPECT_TRUE(containment::ray_crosses(tilted, on)) << factor;
  }
}

TEST_F(Containments, RefuseWhatQueriesRefuse) {
  PartedScene nest;
  nest.add(solid(cube(1)));
  nest.scene.instances = {{0, at(0, 0, 0)}, {0, at(0.5, 0, 0)}, {0, at(0, 0.5, 0)}};
  const std::vector<ObjectPair> pairs = {{0, 1}, {0, 2}};
  find(nest.scene, pairs);
  const std::vector<Contact> contacts(contacts_.rows().begin(), contacts_.rows().end());

  auto wrong = contacts;
  std::swap(wrong.front(), wrong.back());
  EXPECT_EQ(query_.find(scene_, pairs, wrong), Status::kUnknownContact);
  EXPECT_EQ(scene_.where(), 1u);
  wrong = contacts;
  wrong.back().pair = 2;
  EXPECT_EQ(query_.find(scene_, pairs, wrong), Status::kUnknownContact);
  EXPECT_EQ(scene_.where(), wrong.size() - 1);
  wrong = contacts;
  wrong[0].triangle_a = 12;
  EXPECT_EQ(query_.find(scene_, pairs, wrong), Status::kUnknownContact);
  wrong = contacts;
  wrong[0].triangle_b = 12;
  EXPECT_EQ(query_.find(scene_, pairs, wrong), Status::kUnknownContact);
  EXPECT_EQ(scene_.where(), 0u);

  EXPECT_EQ(query_.find(scene_, std::vector<ObjectPair>{{0, 1}, {3, 0}}, {}), Status::kUnknownInstance);
  EXPECT_EQ(scene_.where(), 1u);
  EXPECT_TRUE(query_.rows().empty());

  test::Bytes without = test::made_file(std::vector{test::built_level(cube(1))}, true, false);
  const CheckResult checked = without.check();
  ASSERT_EQ(checked.status, Status::kOk);
  EXPECT_EQ(scene_.set_assets(std::vector{nest.scene.assets.views()[0], checked.asset}), Status::kOk);
  EXPECT_EQ(query_.find(scene_, {}, {}), Status::kNoTopology);
  EXPECT_EQ(scene_.where(), 1u);
}

}  // namespace
}  // namespace tandem
