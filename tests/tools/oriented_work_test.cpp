#include "statistics/oriented_work.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "build/sample_asset.h"
#include "kernels/asked.h"
#include "kernels/common/traversal.h"
#include "kernels/geometry/oriented_test.h"
#include "statistics/near_contact.h"
#include "tandem/kernels/contact_query.h"

namespace tandem {
namespace {

using test::Bytes;
using FacePairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

// Contacts of a at the identity and b, by the boxes of the mesh's axes.
FacePairs contacts(const AssetView& a, const AssetView& b, const Pose& pose_of_b) {
  const AssetView assets[] = {a, b};
  const Instance instances[] = {{0, kIdentityPose}, {1, pose_of_b}};
  const ObjectPair pair = {0, 1};
  test::Asked<ContactQuery> query;
  EXPECT_EQ(query.set_assets(assets), Status::kOk);
  EXPECT_EQ(query.find(instances, {&pair, 1}, {}), Status::kOk);
  FacePairs faces;
  for (const Contact& contact : query.rows()) faces.insert({contact.face_a, contact.face_b});
  return faces;
}

// Candidates of oriented boxes, and how often any was met again.
struct Candidates {
  FacePairs faces;
  std::uint64_t again = 0;
};

Candidates candidates_of(const AssetView& asset_a, const AssetView& asset_b, const Pose& pose_of_b) {
  const LevelView a = asset_a.level(), b = asset_b.level();
  const TreeExtent extent_a = extent_of(a.blocks[0]), extent_b = extent_of(b.blocks[0]);
  RelativePose b_in_a;
  EXPECT_EQ(relative_pose(for_stored_coordinates(kIdentityPose, asset_a.header->origin), extent_a,
                          for_stored_coordinates(pose_of_b, asset_b.header->origin), extent_b, b_in_a),
            RelativePoseStatus::kOk);
  const float slack = oriented_slack(b_in_a, extent_a, extent_b);
  const auto test = [&](const OrientedBlock& block_a, const OrientedBlock& block_b) {
    const OrientedPose pose = oriented_pose(b_in_a.rotation, b_in_a.translation, slack,
                                            frame_of(block_a.rotation), frame_of(block_b.rotation));
    std::uint32_t mask = 0;
    for (int bit = 0; bit < 16; ++bit) {
      if (overlap_oriented(box_of(block_a, bit / 4), box_of(block_b, bit % 4), pose)) mask |= 1u << bit;
    }
    return mask;
  };
  Candidates out;
  const auto face = [](const LevelView& level, const OrientedBlock& block, int node) {
    return level.triangles[child_of(block, node) & ~OrientedBlock::kIsLeafBlock].source_face();
  };
  traverse(a.oriented_blocks, b.oriented_blocks, test,
           [&](const OrientedBlock& block_a, const OrientedBlock& block_b, std::uint32_t mask) {
             for (; mask != 0; mask &= mask - 1) {
               const int bit = lowest_bit(mask);
               out.again += !out.faces.insert({face(a, block_a, bit / 4), face(b, block_b, bit % 4)}).second;
             }
             return true;
           });
  return out;
}

TEST(OrientedWork, CountsCandidatesAmongWhichAreAllContacts) {
  std::size_t met = 0;
  for (const std::uint32_t n : {1u, 5u, 40u, 300u}) {
    for (const std::uint32_t m : {3u, 64u, 300u}) {
      const Bytes file_a(test::make_file(test::random_mesh(n, n))),
          file_b(test::make_file(test::random_mesh(m, m + 1), build::Imaginary::free));
      const AssetView a = file_a.check().asset, b = file_b.check().asset;
      const OrientedWork work(a, b);
      Random random(n + 7 * m);
      for (int i = 0; i < 20; ++i) {
        const Rotation turn = random_rotation(random);
        const Vector at = {random.uniform(), random.uniform(), random.uniform()};
        const Pose pose = place(0, turn, {0.5, 0.5, 0.5}, at).pose;
        const Candidates candidates = candidates_of(a, b, pose);
        for (const auto& contact : contacts(a, b, pose)) {
          EXPECT_TRUE(candidates.faces.count(contact)) << contact.first << " and " << contact.second;
          ++met;
        }
        EXPECT_EQ(candidates.again, 0u);
        const auto counted = work.count(pose);
        ASSERT_TRUE(counted);
        EXPECT_EQ(counted->candidates, candidates.faces.size());
      }
    }
  }
  EXPECT_GT(met, 300u);
}

TEST(OrientedWork, StopsWhereThereIsMoreThanItMayCount) {
  const Bytes file(test::make_file(test::random_mesh(300, 1)));
  const AssetView asset = file.check().asset;
  const OrientedWork work(asset, asset);
  const auto all = work.count(kIdentityPose);
  ASSERT_TRUE(all);
  EXPECT_GT(all->block_pairs, 100u);
  EXPECT_TRUE(work.count(kIdentityPose, all->block_pairs));
  EXPECT_FALSE(work.count(kIdentityPose, all->block_pairs - 1));
}

TEST(OrientedWork, SaysNothingOfWhatNoGpuWalks) {
  const test::Mesh mesh = test::random_mesh(20, 1);
  test::Mesh far = mesh;
  for (auto& point : far.points) point[0] *= 1e37f;
  const Bytes file(test::make_file(mesh)), far_file(test::make_file(far));
  const AssetView asset = file.check().asset;
  EXPECT_TRUE(OrientedWork(asset, asset).count(kIdentityPose));
  EXPECT_FALSE(OrientedWork(asset, far_file.check().asset).count(kIdentityPose));
  EXPECT_FALSE(OrientedWork(far_file.check().asset, asset).count(kIdentityPose));
}

}  // namespace
}  // namespace tandem
