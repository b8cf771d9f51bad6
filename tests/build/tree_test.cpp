#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "bvhbuild/tree/legal_splits.h"
#include "bvhbuild/tree/splitter.h"
#include "bvhbuild/tree/tree.h"
#include "parallel/parallel.h"
#include "sample_asset.h"
#include "statistics/statistics.h"
#include "tandem/build/build_asset.h"

namespace tandem::build {
namespace {

using namespace test;

// The checker proves that each triangle hangs below one leaf, that boxes contain and that no block is
// partial; what is left is the bound.
void expect_sound(const Mesh& mesh, Imaginary imaginary, const std::string& what) {
  const Bytes file(make_file(mesh, imaginary));
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
  const Bytes file(make_file(mesh, imaginary));
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

TEST(Tree, MeetsTheBoundForManySizes) {
  for (std::uint32_t n = 1; n <= 2000; n += n < 300 ? 1 : 17)
    expect_sound(random_mesh(n, n), Imaginary::minimal, std::to_string(n));
}

TEST(Tree, FreeTreesAreSoundForManySizes) {
  for (std::uint32_t n = 1; n <= 500; n += n < 100 ? 1 : 17)
    expect_sound(random_mesh(n, n), Imaginary::free, std::to_string(n));
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
      expect_every_triangle_once(random_mesh(n, n), imaginary);
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
    Mesh mesh = random_mesh(333, 9);
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
  const Mesh mesh = random_mesh(10 * kSweepSize, 3);  // binned and swept
  for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free}) {
    std::vector<Image> files;
    for (const unsigned threads : {1, 2, 8}) {
      const parallel::ThreadLimit limit(threads);
      files.push_back(make_file(mesh, imaginary));
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

TEST(LegalSplits, ThereIsAlwaysOneForTwoLeafBlocksAndTwoSlots) {
  for (std::uint32_t n = 5; n <= 3000; ++n) {
    for (std::uint32_t slots = 2; slots <= 4; ++slots) {
      const LegalSplits splits(n, slots);
      bool found = false;
      for (std::uint32_t left = 1; left < n && !found; ++left) found = splits.left_slots(left) != 0;
      EXPECT_TRUE(found) << n << " triangles in " << slots << " slots";
    }
  }
}

TEST(LegalSplits, LieDenselyAroundTheMiddle) {
  for (std::uint32_t n = 100; n <= 3000; ++n) {
    const LegalSplits splits(n, 4);
    std::uint32_t distance = 0;
    while (splits.left_slots(n / 2 - distance) == 0 && splits.left_slots(n / 2 + distance) == 0) ++distance;
    EXPECT_LE(distance, 12u) << n;
  }
}

TEST(LegalSplits, KeepTheNumberOfBlocks) {
  for (std::uint32_t n = 5; n <= 400; ++n) {
    const LegalSplits splits(n, 4);
    for (std::uint32_t left = 1; left < n; ++left) {
      const std::uint32_t slots = splits.left_slots(left);
      if (slots == 0) continue;
      const auto blocks = [](std::uint32_t triangles, std::uint32_t k) {
        return leaf_blocks_for(triangles) + internal_blocks_for(leaf_blocks_for(triangles), k);
      };
      EXPECT_EQ(blocks(left, slots) + blocks(n - left, 4 - slots), blocks(n, 4)) << n << " at " << left;
    }
  }
}

// A bumpy sheet of 2 n^2 triangles with some soup over it: large enough that threads share every step.
struct Sheet {
  std::vector<Point> points;
  std::vector<TriangleIndices> triangles;

  explicit Sheet(std::uint32_t n) {
    std::mt19937 random(7);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    for (std::uint32_t i = 0; i <= n; ++i) {
      for (std::uint32_t j = 0; j <= n; ++j)
        points.push_back({i / double{1024}, j / double{1024}, 0.01 * uniform()});
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; j < n; ++j) {
        const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
        triangles.push_back({a, b, a + 1});
        triangles.push_back({a + 1, b, b + 1});
      }
    }
    for (std::uint32_t k = 0; k < n; ++k) {
      const auto first = static_cast<std::uint32_t>(points.size());
      for (int corner = 0; corner < 3; ++corner) points.push_back({uniform(), uniform(), uniform()});
      triangles.push_back({first, first + 1, first + 2});
    }
  }

  std::vector<std::byte> built(BuildOptions options, unsigned threads) const {
    options.threads = threads;
    OptimisationWatch watch;
    const BuiltAsset asset = build_asset({points, triangles, {}, 0, {}}, options, {}, watch);
    EXPECT_TRUE(asset.file);
    const Image& image = asset.file->image;
    return {image.data(), image.data() + image.size()};
  }
};

TEST(BuildAsset, GivesTheSameBytesWhateverTheNumberOfThreads) {
  const Sheet sheet(170);  // 57,970 triangles: beyond what is binned, and several regions of the optimiser
  for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free, Imaginary{0.1}}) {
    const BuildOptions options = {.imaginary = imaginary};
    const std::vector<std::byte> one = sheet.built(options, 1);
    for (const unsigned threads : {2u, 3u, 16u})
      EXPECT_TRUE(sheet.built(options, threads) == one) << imaginary.share << ", " << threads << " threads";
  }
}

}  // namespace
}  // namespace tandem::build
