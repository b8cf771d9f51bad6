// Tests refitted trees: that they contain what is below them, and that every way writes the same bytes.
#include "kernels/refit/deformed_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <numeric>

#include "bent_mesh.h"

namespace tandem::test {
namespace {

struct Refittable {
  explicit Refittable(const Mesh& mesh)
      : file(make_refittable_file(mesh)), view(file.check().asset), rest(view.level()) {}
  Bytes file;
  AssetView view;
  LevelView rest;
};

bool same(const LevelView& x, const LevelView& y) {
  return std::memcmp(x.blocks, y.blocks, x.block_count * sizeof(Block)) == 0 &&
         std::memcmp(x.triangles, y.triangles, x.triangle_count * sizeof(Triangle)) == 0;
}

// Proves every box by exact predicates, and that real nodes are what they were.
void expect_sound(const LevelView& rest, const LevelView& level) {
  for (std::uint32_t b = 0; b < level.block_count; ++b) {
    const Block& block = level.blocks[b];
    for (int i = 0; i < kNodesPerBlock; ++i) {
      ASSERT_EQ(block.kind[i], rest.blocks[b].kind[i]);
      ASSERT_EQ(block.index[i], rest.blocks[b].index[i]);
      const Box box = box_of(block, i);
      if (block.kind[i] == NodeKind::imaginary) {
        ASSERT_TRUE(is_imaginary_box(box)) << b;
      } else if (block.kind[i] == NodeKind::leaf) {
        const Triangle& triangle = level.triangles[block.index[i]];
        for (const auto& corner : triangle.corner)
          ASSERT_TRUE(contains(box, corner.position)) << b << " " << i;
      } else {
        const Block& child = level.blocks[block.index[i]];
        for (int j = 0; j < kNodesPerBlock && child.kind[j] != NodeKind::imaginary; ++j)
          ASSERT_TRUE(contains(box, box_of(child, j))) << b << " " << i << " " << j;
      }
      for (int k = 0; k < 3 && block.kind[i] != NodeKind::imaginary; ++k)
        ASSERT_TRUE(std::isfinite(box.centre[k]) && std::isfinite(box.half_extent[k])) << b;
    }
  }
}

std::vector<Mesh> meshes() {
  std::vector<Mesh> out;
  for (const int cells : {1, 2, 9}) out.push_back(sheet(2, cells));
  out.push_back(cube(0.75f, 3));
  for (const std::uint32_t count : {1u, 2u, 5u, 17u, 200u}) out.push_back(random_mesh(count, count));
  for (Mesh& mesh : out) mesh = welded(mesh);
  return out;
}

TEST(DeformedTree, AtRestIsTheFilesTree) {
  for (const Mesh& mesh : meshes()) {
    const Refittable asset(mesh);
    DeformedTree tree;
    ASSERT_EQ(tree.begin(asset.rest), Status::kOk);
    const std::vector<float> positions = single(positions_of(mesh));
    ASSERT_EQ(tree.refit(positions), Status::kOk);
    EXPECT_TRUE(same(tree.level(), asset.rest));
    EXPECT_EQ(tree.looseness(), 1);
    // A tree that was bent comes back.
    RandomPoses random(3);
    ASSERT_EQ(tree.refit(single(bent(Bend::noise, 5, positions_of(mesh), random))), Status::kOk);
    EXPECT_FALSE(same(tree.level(), asset.rest));
    ASSERT_EQ(tree.refit(positions), Status::kOk);
    EXPECT_TRUE(same(tree.level(), asset.rest));
  }
}

TEST(DeformedTree, ContainsItsTrianglesAfterEveryStepOfLongWildDeformations) {
  RandomPoses random(1);
  for (const Mesh& mesh : meshes()) {
    const Refittable asset(mesh);
    DeformedTree tree;
    ASSERT_EQ(tree.begin(asset.rest), Status::kOk);
    Positions positions = positions_of(mesh);
    for (int step = 0; step < trials(60, 50); ++step) {
      const Bend bend = kBends[random.below(std::size(kBends))];
      const Positions now = bent(bend, random.symmetric(4), positions, random);
      ASSERT_EQ(tree.refit(single(now)), Status::kOk);
      expect_sound(asset.rest, tree.level());
      for (std::uint32_t t = 0; t < asset.rest.triangle_count; ++t) {
        const Triangle &was = asset.rest.triangles[t], &is = tree.level().triangles[t];
        ASSERT_TRUE(was.source_face() == is.source_face() && was.part() == is.part() && is.corner[2].w == 0);
        for (std::uint32_t c = 0; c < 3; ++c) {
          const auto& p = now[asset.rest.source_vertices[asset.rest.topology[t].vertex[c]]];
          for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(is.corner[c].position[k], static_cast<float>(p[k]));
        }
      }
      if (bend == Bend::noise || bend == Bend::twist) positions = now;
    }
  }
}

// Coordinates of any bits, whose exponents lie far apart: boxes are rounded in every way there is.
TEST(DeformedTree, ContainsTrianglesOfAnyFiniteCoordinates) {
  RandomPoses random(2);
  const Mesh mesh = random_mesh(60, 4);
  const Refittable asset(mesh);
  DeformedTree tree;
  ASSERT_EQ(tree.begin(asset.rest), Status::kOk);
  std::vector<float> positions(3 * mesh.points.size());
  for (int step = 0; step < trials(300, 100); ++step) {
    for (float& x : positions) {
      do {
        const auto bits = static_cast<std::uint32_t>(random.engine()());
        std::memcpy(&x, &bits, sizeof x);
        if (step % 3 == 0)
          x = std::ldexp(1 + static_cast<float>(bits % 8) * 0x1p-23f, static_cast<int>(bits >> 8) % 26);
      } while (!(std::fabs(x) <= kMaxCoordinate));
    }
    ASSERT_EQ(tree.refit(positions), Status::kOk);
    expect_sound(asset.rest, tree.level());
  }
}

TEST(DeformedTree, AllWaysWriteTheSameBytes) {
  RandomPoses random(5);
  int ways = 0;
  for (const BlockPairVariant variant : kBlockPairVariants) {
    const Refit way = refit_way(variant), scalar = refit_way(BlockPairVariant::scalar);
    ways += way != nullptr;
    for (const Mesh& mesh : meshes()) {
      const Refittable asset(mesh);
      DeformedTree of[2];
      for (DeformedTree& tree : of) ASSERT_EQ(tree.begin(asset.rest), Status::kOk);
      for (int step = 0; step < 20 && way != nullptr; ++step) {
        const std::vector<float> positions = single(
            bent(kBends[random.below(std::size(kBends))], random.symmetric(4), positions_of(mesh), random));
        const double x = of[0].refit_by(way, positions.data()), y = of[1].refit_by(scalar, positions.data());
        ASSERT_TRUE(same(of[0].level(), of[1].level()));
        ASSERT_EQ(x, y);
      }
    }
  }
  EXPECT_GE(ways, 1);
}

TEST(DeformedTree, KnowsFloat64PositionsAsTheyAre) {
  RandomPoses random(6);
  for (const Mesh& mesh : meshes()) {
    const Refittable asset(mesh);
    DeformedTree tree, of_single;
    ASSERT_EQ(tree.begin(asset.rest), Status::kOk);
    ASSERT_EQ(of_single.begin(asset.rest), Status::kOk);
    for (const Bend bend : kBends) {
      const Positions now = bent(bend, 0.7, positions_of(mesh), random);
      ASSERT_EQ(tree.refit(flat(now)), Status::kOk);
      expect_sound(asset.rest, tree.level());
      const std::vector<float> rounded = single(now);
      if (std::equal(rounded.begin(), rounded.end(), flat(now).begin())) {
        ASSERT_EQ(of_single.refit(rounded), Status::kOk);
        EXPECT_EQ(tree.level().precise, nullptr);
        EXPECT_TRUE(same(tree.level(), of_single.level()));
        continue;
      }
      ASSERT_NE(tree.level().precise, nullptr);
      for (std::uint32_t t = 0; t < asset.rest.triangle_count; ++t) {
        for (std::uint32_t c = 0; c < 3; ++c) {
          const auto& p = now[asset.rest.source_vertices[asset.rest.topology[t].vertex[c]]];
          for (std::size_t k = 0; k < 3; ++k) {
            ASSERT_EQ(tree.level().precise[t].position[c][k], p[k]);
            ASSERT_LE(std::fabs(p[k] - static_cast<double>(tree.level().triangles[t].corner[c].position[k])),
                      tree.rounding()[k]);
          }
        }
      }
    }
  }
}

TEST(DeformedTree, IsLooserOnceNeighboursLieFarApart) {
  const Mesh mesh = random_mesh(1000, 8);  // no triangle shares a corner with another
  const Refittable asset(mesh);
  DeformedTree tree;
  ASSERT_EQ(tree.begin(asset.rest), Status::kOk);
  RandomPoses random(7);
  ASSERT_EQ(tree.refit(single(bent(Bend::huge, 1, positions_of(mesh), random))), Status::kOk);
  EXPECT_NEAR(tree.looseness(), 1, 1e-6);  // the same shape, larger
  // Each triangle goes to the place of another, so the box around all stays about as it is.
  std::vector<std::size_t> place(mesh.triangles.size());
  std::iota(place.begin(), place.end(), 0u);
  std::shuffle(place.begin(), place.end(), random.engine());
  const Positions at_rest = positions_of(mesh);
  Positions elsewhere = at_rest;
  for (std::size_t t = 0; t < place.size(); ++t) {
    const auto &from = at_rest[mesh.triangles[t][0]], &to = at_rest[mesh.triangles[place[t]][0]];
    for (const std::uint32_t corner : mesh.triangles[t]) {
      for (std::size_t k = 0; k < 3; ++k) elsewhere[corner][k] += to[k] - from[k];
    }
  }
  ASSERT_EQ(tree.refit(single(elsewhere)), Status::kOk);
  EXPECT_GT(tree.looseness(), 4);
  ASSERT_EQ(tree.refit(single(bent(Bend::collapse, 1, positions_of(mesh), random))), Status::kOk);
  EXPECT_EQ(tree.looseness(), 1);
}

TEST(CheckPositions, NamesTheFirstBadVertex) {
  float lower[3], upper[3];
  for (const std::size_t count : {1u, 3u, 4u, 5u, 33u}) {
    std::vector<float> x(3 * count, 1.0f);
    EXPECT_EQ(check_positions(std::span<const float>(x), lower, upper), count);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(lower[k] == 1 && upper[k] == 1);
    for (const float bad : {NAN, INFINITY, -INFINITY, std::nextafter(kMaxCoordinate, INFINITY)}) {
      for (std::size_t i = 0; i < x.size(); ++i) {
        x[i] = bad;
        EXPECT_EQ(check_positions(std::span<const float>(x), lower, upper), i / 3);
        x[i] = 1;
      }
    }
    const std::vector<double> y(3 * count, 1 + 0x1p-30);
    EXPECT_EQ(check_positions(std::span<const double>(y), lower, upper), count);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(lower[k] == 1 && upper[k] == 1 + 0x1p-23f);
  }
}

}  // namespace
}  // namespace tandem::test
