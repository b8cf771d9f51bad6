// Self-contacts of a level against those that the contact query finds.
#include "bvhbuild/levels/self_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "kernels/asked.h"
#include "kernels/solid_meshes.h"
#include "levels/stored_level.h"
#include "tandem/kernels/contact_query.h"

namespace tandem::test {
namespace {

using build::count_self_contacts;

/// Large triangles on a coarse grid: many meet, many have corners in common, some are flat.
Mesh crossing(std::uint32_t triangles, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Mesh mesh;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    std::array<float, 3> corner[3];
    for (auto& point : corner)
      for (float& x : point) x = static_cast<float>(random() % 8) / 3;
    mesh.add(corner[0], corner[1], corner[2]);
  }
  return mesh;
}

bool share_a_corner(const Triangle& a, const Triangle& b) {
  for (const auto& p : a.corner)
    for (const auto& q : b.corner)
      if (std::equal(p.position, p.position + 3, q.position)) return true;
  return false;
}

std::uint64_t found_by_query(const AssetView& asset) {
  test::Asked<ContactQuery> query;
  const Instance instance = {0, kIdentityPose};
  const ObjectPair itself = {0, 0};
  EXPECT_EQ(query.set_assets({&asset, 1}), Status::kOk);
  EXPECT_EQ(query.find({&instance, 1}, {&itself, 1}, {}), Status::kOk);
  const Triangle* triangles = asset.level().triangles;
  return std::count_if(query.rows().begin(), query.rows().end(), [&](const Contact& contact) {
    return !share_a_corner(triangles[contact.triangle_a], triangles[contact.triangle_b]);
  });
}

TEST(SelfContacts, AreThoseOfTheContactQuery) {
  const Mesh balls = joined(sphere(1, 3), moved(sphere(1, 3), 1, 0, 0));
  for (const Mesh& mesh : {crossing(300, 1), crossing(3, 2), balls, random_mesh(3000, 3)}) {
    const StoredLevel level(mesh);
    const std::uint64_t expected = found_by_query(level.asset());
    EXPECT_GT(expected, 0u);
    EXPECT_EQ(count_self_contacts(level.view()), expected);
    EXPECT_EQ(count_self_contacts(level.view(), expected), expected);
    EXPECT_EQ(count_self_contacts(level.view(), expected - 1), std::nullopt);
  }
}

TEST(SelfContacts, OfASolidThereAreNone) {
  EXPECT_EQ(count_self_contacts(StoredLevel(sphere(1, 4)).view(), 0), 0u);
}

TEST(SelfContacts, AreNotCountedWhereAllTrianglesShareAnEdge) {
  const auto fan = [](std::uint32_t count) {
    Mesh mesh;
    for (std::uint32_t i = 0; i < count; ++i) {
      const double angle = 6.28 * i / count;
      mesh.add({0, 0, 0}, {0, 0, 1},
               {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0.5f});
    }
    return mesh;
  };
  EXPECT_EQ(count_self_contacts(StoredLevel(fan(3000)).view()), 0u);
  EXPECT_EQ(count_self_contacts(StoredLevel(fan(20'000)).view()), std::nullopt);
}

}  // namespace
}  // namespace tandem::test
