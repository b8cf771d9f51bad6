// Tests the order in which a GPU refits a tree, by refitting in that order on the CPU.
#include "kernels/refit/refit_plan.h"

#include <gtest/gtest.h>

#include <cstring>

#include "bent_mesh.h"
#include "gpu/made_files.h"
#include "kernels/refit/deformed_tree.h"

namespace tandem::test {
namespace {

using gpu::RefitBlock;
using gpu::RefitCluster;
using gpu::RefitPlan;
using gpu::RefitPlans;

/// Does what a GPU does by a plan.
struct PlannedRefit {
  const LevelView& rest;
  const RefitPlans& plans;
  const RefitPlan& plan;
  const std::vector<float>& positions;
  std::vector<std::uint32_t> block_of;  // of each oriented block
  std::vector<Block> blocks;
  std::vector<Triangle> triangles;
  std::vector<Box> roots;
  std::vector<int> refitted;        // how often, of each block
  std::vector<int> moved;           // and of each triangle
  std::vector<char> root_is_there;  // in an earlier round

  PlannedRefit(const LevelView& level, const RefitPlans& all, const RefitPlan& own,
               const std::vector<float>& now)
      : rest(level),
        plans(all),
        plan(own),
        positions(now),
        block_of(blocks_of_oriented(level)),
        blocks(level.blocks, level.blocks + level.block_count),
        triangles(level.triangles, level.triangles + level.triangle_count),
        roots(own.roots),
        refitted(level.block_count),
        moved(level.triangle_count),
        root_is_there(own.roots) {
    for (std::uint32_t round = 0; round < plan.rounds; ++round) {
      std::vector<char> there = root_is_there;
      for (std::uint32_t c = plan.first_cluster[round]; c < plan.first_cluster[round + 1]; ++c)
        refit(plans.clusters[c], round == 0, there);
      root_is_there = there;
    }
  }

  Box move_triangle(const RefitCluster& cluster, std::uint32_t i) {
    Triangle& triangle = triangles[cluster.first_input + i];
    ++moved[cluster.first_input + i];
    Position lower, upper;
    for (std::uint32_t c = 0; c < 3; ++c) {
      const gpu::CornerSource& source =
          plans.corners[plan.first_corner + 3 * std::size_t{cluster.first_input + i} + c];
      EXPECT_EQ(triangle.corner[c].w, source.w);
      for (std::size_t k = 0; k < 3; ++k) {
        const float x = positions[3 * std::size_t{source.vertex} + k];
        triangle.corner[c].position[k] = x;
        lower[k] = c == 0 || x < lower[k] ? x : lower[k];
        upper[k] = c == 0 || upper[k] < x ? x : upper[k];
      }
    }
    return enclose(lower, upper);
  }

  void refit(const RefitCluster& cluster, bool from_triangles, std::vector<char>& there) {
    ASSERT_LE(cluster.blocks, gpu::kMostClusterBlocks);
    ASSERT_LE(cluster.inputs, gpu::kMostInputs);
    const std::uint32_t before = from_triangles ? 0 : cluster.inputs;
    std::vector<Box> boxes(before + cluster.blocks);
    std::uint32_t known = before;
    for (std::uint32_t i = 0; i < before; ++i) {
      const std::uint32_t root = plans.inputs[cluster.first_input + i];
      ASSERT_TRUE(root_is_there[root]);
      boxes[i] = roots[root];
    }
    std::uint32_t begin = 0;
    for (std::uint32_t height = 0; height < cluster.heights; ++height) {
      const std::uint32_t end = plans.height_ends[cluster.first_height + height];
      for (std::uint32_t i = begin; i < end; ++i) {
        const RefitBlock& own = plans.blocks[cluster.first_block + i];
        expect_same_block(own);
        Block& block = blocks[own.block];
        ++refitted[own.block];
        for (int node = 0; node < kNodesPerBlock; ++node) {
          const std::uint32_t below = own.below[node];
          ASSERT_EQ(below == RefitBlock::kNothing, block.kind[node] == NodeKind::imaginary);
          if (below == RefitBlock::kNothing) continue;
          const bool is_leaf = from_triangles && height == 0;
          ASSERT_EQ(is_leaf, block.kind[node] == NodeKind::leaf);
          ASSERT_LT(below, is_leaf ? cluster.inputs : known);
          set_node(block, node, is_leaf ? move_triangle(cluster, below) : boxes[below], block.index[node],
                   block.kind[node]);
        }
        boxes[before + i] = enclose(block);
        ASSERT_EQ(own.root == kNoIndex, parent_is_in_cluster(cluster, own.block));
        if (own.root == kNoIndex) continue;
        ASSERT_FALSE(there[own.root]);
        there[own.root] = 1;
        roots[own.root] = boxes[before + i];
      }
      known = before + end;
      begin = end;
    }
    ASSERT_EQ(begin, cluster.blocks);
  }

  // The root of the tree has no parent, and counts.
  bool parent_is_in_cluster(const RefitCluster& cluster, std::uint32_t number) const {
    bool found = number == 0;
    for (std::uint32_t i = 0; i < cluster.blocks; ++i) {
      const Block& block = blocks[plans.blocks[cluster.first_block + i].block];
      for (int node = 0; node < kNodesPerBlock; ++node)
        found = found || (block.kind[node] == NodeKind::internal && block.index[node] == number);
    }
    return found;
  }

  void expect_same_block(const RefitBlock& own) const {
    if (rest.oriented_blocks == nullptr) {
      EXPECT_EQ(own.oriented, kNoIndex);
      return;
    }
    EXPECT_EQ(block_of[own.oriented], own.block);
    EXPECT_EQ(rest.oriented_blocks[own.oriented].first_below, own.first_below);
  }
};

/// Plans of all files at once are right; rounds: how many the last takes.
void expect_right_plans(const std::vector<std::unique_ptr<Bytes>>& files, std::uint32_t rounds) {
  RandomPoses random(5);
  RefitPlans plans;
  std::vector<RefitPlan> of(files.size());
  std::vector<LevelView> rest;
  for (std::size_t i = 0; i < files.size(); ++i) {
    rest.push_back(files[i]->check().asset.level());
    ASSERT_EQ(plans.add(rest[i], of[i]), Status::kOk);
  }
  EXPECT_EQ(of.back().rounds, rounds);
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::vector<float> positions(3 * files[i]->header().source_vertices);
    for (float& x : positions) x = static_cast<float>(random.symmetric(3));
    DeformedTree tree;
    ASSERT_EQ(tree.begin(rest[i]), Status::kOk);
    ASSERT_EQ(tree.refit(positions), Status::kOk);
    const PlannedRefit planned(rest[i], plans, of[i], positions);
    for (const int count : planned.refitted) ASSERT_EQ(count, 1);
    for (const int count : planned.moved) ASSERT_EQ(count, 1);
    EXPECT_EQ(std::memcmp(planned.blocks.data(), tree.level().blocks, planned.blocks.size() * sizeof(Block)),
              0);
    EXPECT_EQ(std::memcmp(planned.triangles.data(), tree.level().triangles,
                          planned.triangles.size() * sizeof(Triangle)),
              0);
  }
}

TEST(RefitPlan, RefitsEveryTreeAsTheCpuDoes) {
  std::vector<std::unique_ptr<Bytes>> files;
  const auto add = [&](const Mesh& mesh) {
    files.push_back(std::make_unique<Bytes>(make_refittable_file(welded(mesh))));
  };
  for (const std::uint32_t count : {1u, 2u, 5u, 17u, 400u, 600u, 3000u}) add(random_mesh(count, count));
  add(cube(0.5f, 110));
  expect_right_plans(files, 3);
}

TEST(RefitPlan, RefitsTreesWithoutOrientedBlocks) {
  std::vector<std::unique_ptr<Bytes>> files;
  for (const std::uint32_t count : {3u, 900u}) {
    const MadeLevel level = built_level(random_mesh(count, count));
    files.push_back(std::make_unique<Bytes>(made_file({&level, 1}, false)));
  }
  expect_right_plans(files, 2);
}

TEST(RefitPlan, RefitsTheDeepestTree) {
  const MadeLevel level = deep_level(random_mesh(triangles_of_deep_level(kMaxDepth), 6), kMaxDepth);
  std::vector<std::unique_ptr<Bytes>> files;
  files.push_back(std::make_unique<Bytes>(made_file({&level, 1})));
  expect_right_plans(files, 2);
}

}  // namespace
}  // namespace tandem::test
