#include "bvhbuild/tree/tree.h"

#include <gtest/gtest.h>

#include <cmath>

#include "bvhbuild/tree/legal_splits.h"
#include "bvhbuild/tree/splitter.h"
#include "parallel/parallel.h"
#include "sample_asset.h"
#include "statistics/statistics.h"

namespace tandem::build {
namespace {

using test::Bytes;
using test::Mesh;

// The checker proves that each triangle hangs below one leaf, that boxes contain and that no block is
// partial; what is left is the bound.
void expect_sound(const Mesh& mesh, Imaginary imaginary, const std::string& what) {
  const Bytes file(test::make_file(mesh, imaginary));
  const CheckResult result = file.check();
  ASSERT_EQ(result.status, Status::kOk) << what << ": " << name(result.status) << " at " << result.where;
  const TreeStatistics statistics =
      measure_tree(result.asset.level(), result.asset.header->lower, result.asset.header->upper);
  EXPECT_EQ(statistics.leaf_nodes, mesh.triangles.size()) << what;
  EXPECT_EQ(statistics.partial_leaf_blocks, 0u) << what;
  if (imaginary == Imaginary::minimal) {
    EXPECT_EQ(statistics.imaginary_nodes, statistics.imaginary_minimum) << what;
    EXPECT_EQ(statistics.leaf_blocks + statistics.internal_blocks,
              blocks_for(static_cast<std::uint32_t>(mesh.triangles.size())));
  }
}

// The multiset of triangles in the file is that of the mesh: each source face once, at its own coordinates.
void expect_every_triangle_once(const Mesh& mesh, Imaginary imaginary) {
  const Bytes file(test::make_file(mesh, imaginary));
  const LevelView level = file.check().asset.level();
  std::vector<int> seen(mesh.triangles.size(), 0);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    const std::uint32_t face = level.triangles[t].source_face();
    ++seen[face];
    for (int i = 0; i < 3; ++i) {
      const auto& point = mesh.points[mesh.triangles[face][i]];
      for (int k = 0; k < 3; ++k) ASSERT_EQ(level.triangles[t].corner[i].position[k], point[k]);
    }
  }
  for (const int times : seen) ASSERT_EQ(times, 1);
}

Mesh coincident(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t t = 0; t < n; ++t) mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  return mesh;
}

Mesh single_point(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t t = 0; t < n; ++t) mesh.add({2, 3, 4}, {2, 3, 4}, {2, 3, 4});
  return mesh;
}

// All on the z axis, so that areas vanish and orders along x and y say nothing.
Mesh collinear(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t t = 0; t < n; ++t) {
    const auto z = static_cast<float>((t * 7919u) % n);
    mesh.add({0, 0, z}, {0, 0, z + 1}, {0, 0, z + 2});
  }
  return mesh;
}

// Each triangle half as large as the last: surface-area splits would peel off one after the other.
Mesh geometric_series(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t t = 0; t < n; ++t) {
    const float s = std::ldexp(1.0f, -static_cast<int>(t % 140));
    mesh.add({s, 0, 0}, {2 * s, 0, 0}, {s, s, s});
  }
  return mesh;
}

TEST(Tree, MeetsTheBoundForEverySizeUpTo2000) {
  for (std::uint32_t n = 1; n <= 2000; ++n)
    expect_sound(test::random_mesh(n, n), Imaginary::minimal, std::to_string(n));
}

TEST(Tree, FreeTreesAreSoundForEverySizeUpTo500) {
  for (std::uint32_t n = 1; n <= 500; ++n)
    expect_sound(test::random_mesh(n, n), Imaginary::free, std::to_string(n));
}

TEST(Tree, DegenerateMeshesAreSoundForManySizes) {
  for (std::uint32_t n = 1; n <= 2000; n = n < 60 ? n + 1 : n + 37) {
    for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free}) {
      const std::string size = std::to_string(n);
      expect_sound(coincident(n), imaginary, "coincident " + size);
      expect_sound(single_point(n), imaginary, "single point " + size);
      expect_sound(collinear(n), imaginary, "collinear " + size);
      expect_sound(geometric_series(n), imaginary, "geometric series " + size);
    }
  }
}

TEST(Tree, HoldsEveryTriangleOnceAndUnchanged) {
  for (const std::uint32_t n : {1u, 7u, 64u, 1000u, 20000u}) {
    for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free}) {
      expect_every_triangle_once(test::random_mesh(n, n), imaginary);
    }
  }
}

TEST(Tree, DoesNotGrowDeepWhereAllSplitsCostTheSame) {
  const Mesh mesh = coincident(100000);
  for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free}) {
    EXPECT_LE(build_tree(mesh.geometry(), imaginary).depth, 20u);
  }
}

TEST(Tree, StaysWithinTheDepthLimitWhereGreedySplitsWouldPeel) {
  Mesh mesh;
  for (std::uint32_t t = 0; t < 30000; ++t) {
    const float x = std::ldexp(1.0f, static_cast<int>(t % 240) - 120);
    mesh.add({x, 0, 0}, {1.5f * x, x, 0}, {x, 0, x});
  }
  for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free})
    expect_sound(mesh, imaginary, "peeling");
}

TEST(Tree, TakesTheLargestTheSmallestAndTheFarthestCoordinates) {
  const auto scaled = [](float scale, float offset) {
    Mesh mesh = test::random_mesh(333, 9);
    for (auto& point : mesh.points) {
      for (float& x : point) x = (x - 0.5f) * scale + offset;
    }
    return mesh;
  };
  for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free}) {
    expect_sound(scaled(3e38f, 0), imaginary, "huge");
    expect_sound(scaled(1e-44f, 0), imaginary, "denormal");
    expect_sound(scaled(1, 1e7f), imaginary, "far");
    expect_sound(scaled(1, -1e30f), imaginary, "all in one point, far away");
    Mesh sheet = scaled(1e-20f, 0);  // 10^40 times farther away than large
    for (auto& point : sheet.points) point[1] = 1e20f;
    expect_sound(sheet, imaginary, "a tiny sheet far away");
  }
}

TEST(Tree, BytesAreTheSameForOneThreadAndForMany) {
  const Mesh mesh = test::random_mesh(50 * kSweepSize, 3);  // binned and swept
  for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free}) {
    std::vector<Image> files;
    for (const unsigned threads : {1, 2, 8}) {
      const parallel::ThreadLimit limit(threads);
      files.push_back(test::make_file(mesh, imaginary));
    }
    for (const Image& file : files) {
      ASSERT_EQ(file.size(), files[0].size());
      EXPECT_EQ(std::memcmp(file.data(), files[0].data(), file.size()), 0);
    }
  }
}

// A mesh whose best tree is known: 16 clusters of four triangles each, far apart. Each cluster must be one
// leaf block.
TEST(Tree, KeepsClustersTogether) {
  Mesh mesh;
  for (int cluster = 0; cluster < 16; ++cluster) {
    const auto x = static_cast<float>(cluster % 4) * 100, y = static_cast<float>(cluster / 4) * 100;
    for (int i = 0; i < 4; ++i) {
      const float s = static_cast<float>(i) * 0.1f;
      mesh.add({x + s, y, 0}, {x + 1, y + s, 0}, {x, y + 1, s});
    }
  }
  for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free}) {
    const Tree tree = build_tree(mesh.geometry(), imaginary);
    EXPECT_EQ(tree.leaf_block_count, 16u);
    for (std::size_t first = 0; first < 64; first += 4) {
      for (int i = 1; i < 4; ++i) EXPECT_EQ(tree.order[first] / 4, tree.order[first + i] / 4);
    }
  }
}

}  // namespace
}  // namespace tandem::build
