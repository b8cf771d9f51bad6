#include "bvhbuild/tree/topology.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "bvhbuild/tree/bounds.h"
#include "bvhbuild/tree/working_tree.h"
#include "parallel/parallel.h"
#include "sample_asset.h"
#include "statistics/statistics.h"

namespace tandem::build {
namespace {

using namespace test;

// A wavy sheet: neighbours share corners, as in a real mesh.
Mesh sheet(std::uint32_t squares) {
  Mesh mesh;
  const auto corner = [](std::uint32_t x, std::uint32_t y) {
    const auto u = static_cast<float>(x), v = static_cast<float>(y);
    return std::array<float, 3>{u, v, 3 * std::sin(0.4f * u) * std::cos(0.3f * v)};
  };
  for (std::uint32_t x = 0; x < squares; ++x) {
    for (std::uint32_t y = 0; y < squares; ++y) {
      mesh.add(corner(x, y), corner(x + 1, y), corner(x, y + 1));
      mesh.add(corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1));
    }
  }
  return mesh;
}

// Triangles each within the next, by factors of 4: greedy splits peel them off one by one.
Mesh nested(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t t = 0; t < n; ++t) {
    const float s = std::ldexp(1.0f, -2 * static_cast<int>(t % 60));
    mesh.add({0, 0, 0}, {s, 0, 0}, {0, s, s});
  }
  return mesh;
}

double cost_of(const WorkingTree<Bounds>& tree) {
  double cost = 0;
  for (std::uint32_t block = 1; block < tree.size(); ++block) cost += tree[block].box.visit_cost();
  return cost;
}

TreeStatistics statistics_of(const Mesh& mesh, Imaginary imaginary, Effort effort) {
  const Bytes file(make_file(mesh, imaginary, effort));
  const CheckResult result = file.check();
  EXPECT_EQ(result.status, Status::kOk) << name(result.status) << " at " << result.where;
  if (result.status != Status::kOk) return {};
  return measure_tree(result.asset.level(), result.asset.header->lower, result.asset.header->upper);
}

TEST(Optimise, KeepsTheMinimumOfImaginaryNodesWhateverTheEffort) {
  for (const Effort effort : {Effort::fast, Effort::standard, Effort::best}) {
    for (const std::uint32_t n : {1u, 4u, 5u, 16u, 17u, 63u, 64u, 65u, 301u}) {
      const TreeStatistics statistics = statistics_of(random_mesh(n, n), Imaginary::minimal, effort);
      EXPECT_EQ(statistics.leaf_nodes, n);
      EXPECT_EQ(statistics.imaginary_nodes, statistics.imaginary_minimum) << n;
    }
  }
}

// Follows the subtree of block b; returns the block behind it. Each child must begin where the one before it
// ends, and each leaf must name the next triangle.
std::uint32_t expect_depth_first(const std::vector<Block>& blocks, std::uint32_t b,
                                 std::uint32_t& next_triangle) {
  std::uint32_t end = b + 1;
  for (int i = 0; i < kNodesPerBlock && blocks[b].kind[i] != NodeKind::imaginary; ++i) {
    const bool is_leaf = blocks[b].is_leaf_block();
    EXPECT_EQ(blocks[b].index[i], is_leaf ? next_triangle : end) << "block " << b << ", node " << i;
    if (is_leaf) {
      ++next_triangle;
    } else if (end < blocks.size()) {
      end = expect_depth_first(blocks, end, next_triangle);
    }
  }
  return end;
}

TEST(Optimise, BlocksLieDepthFirstWhateverTheEffort) {
  for (const Effort effort : {Effort::fast, Effort::standard, Effort::best}) {
    for (const Imaginary imaginary : {Imaginary::minimal, Imaginary{0.02}, Imaginary{0.1}, Imaginary::free}) {
      for (const Mesh& mesh : {random_mesh(1, 1), random_mesh(5, 5), sheet(8), nested(100)}) {
        Bytes file(make_file(mesh, imaginary, effort));
        const std::vector<Block> blocks(file.blocks(), file.blocks() + file.level().block_count);
        std::uint32_t triangles = 0;
        EXPECT_EQ(expect_depth_first(blocks, 0, triangles), blocks.size());
        EXPECT_EQ(triangles, mesh.triangles.size());
        EXPECT_EQ(file.check().status, Status::kOk);
      }
    }
  }
}

TEST(Optimise, MoreEffortNeverCostsMore) {
  for (const Mesh& mesh : {sheet(12), random_mesh(300, 5), nested(200)}) {
    const std::vector<Bounds> bounds = normalized_bounds(mesh.geometry());
    for (const auto build : {build_minimal_tree<Bounds>, build_free_tree<Bounds>}) {
      Topology topology = build(bounds);
      double before = cost_of(WorkingTree<Bounds>(topology, bounds));
      for (const Effort effort : {Effort::standard, Effort::best}) {
        OptimisationWatch watch;
        optimise(topology, bounds, effort, watch);
        const double after = cost_of(WorkingTree<Bounds>(topology, bounds));
        EXPECT_LE(after, before);
        before = after;
      }
    }
  }
}

TEST(Optimise, FindsSomethingOnASheet) {
  const Mesh mesh = sheet(20);
  const std::vector<Bounds> bounds = normalized_bounds(mesh.geometry());
  Topology topology = build_minimal_tree(bounds);
  const double greedy = cost_of(WorkingTree<Bounds>(topology, bounds));
  OptimisationWatch watch;
  optimise(topology, bounds, Effort::standard, watch);
  const double exchanged = cost_of(WorkingTree<Bounds>(topology, bounds));
  EXPECT_LT(exchanged, greedy);
  optimise(topology, bounds, Effort::best, watch);
  EXPECT_LT(cost_of(WorkingTree<Bounds>(topology, bounds)), 0.99 * exchanged);
}

TEST(Optimise, NeverDeepensATreeBeyondWhatAFileMayHold) {
  for (const Effort effort : {Effort::standard, Effort::best}) {
    EXPECT_LE(statistics_of(nested(500), Imaginary::minimal, effort).depth, kMaxDepth);
  }
}

TEST(Optimise, BytesAreTheSameForOneThreadAndForMany) {
  const Mesh mesh = random_mesh(20'000, 3);  // several regions
  std::vector<Image> files;
  for (const unsigned threads : {1, 2, 8}) {
    const parallel::ThreadLimit limit(threads);
    files.push_back(make_file(mesh, Imaginary::minimal, Effort::standard));
  }
  for (const Image& file : files) {
    ASSERT_EQ(file.size(), files[0].size());
    EXPECT_EQ(std::memcmp(file.data(), files[0].data(), file.size()), 0);
  }
}

TEST(Optimise, BestEffortIsDeterministicToo) {
  const Mesh mesh = sheet(12);
  const Image a = make_file(mesh, Imaginary::minimal, Effort::best),
              b = make_file(mesh, Imaginary::minimal, Effort::best);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size()), 0);
}

// Stopped while the tree is still full of exchanges that cost: what was better before must come back.
TEST(Optimise, KeepsTheBestTreeWhenStopped) {
  const Mesh mesh = sheet(20);
  const std::vector<Bounds> bounds = normalized_bounds(mesh.geometry());
  Topology exchanged = build_minimal_tree(bounds);
  OptimisationWatch watch;
  optimise(exchanged, bounds, Effort::standard, watch);

  Topology stopped = build_minimal_tree(bounds);
  watch.progress = [&](double share) { watch.stop = share > 0.05; };
  optimise(stopped, bounds, Effort::best, watch);
  EXPECT_TRUE(watch.stop);
  EXPECT_LE(cost_of(WorkingTree<Bounds>(stopped, bounds)), cost_of(WorkingTree<Bounds>(exchanged, bounds)));
}

TEST(Optimise, ProgressGoesFromNothingToTheShareOfTheTree) {
  const Mesh mesh = sheet(12);
  for (const Effort effort : {Effort::fast, Effort::standard, Effort::best}) {
    double first = 1, last = 0;
    OptimisationWatch watch;
    watch.progress = [&](double share) {
      EXPECT_GE(share, last);
      first = std::min(first, share);
      last = share;
    };
    build_tree(mesh.geometry(), Imaginary::minimal, effort, watch);
    EXPECT_LT(first, 0.1);
    EXPECT_EQ(last, build_shares(effort).optimised);
    watch.begin_part(0.99, 1);
    watch.reach(0);
    watch.reach(1);
    EXPECT_EQ(last, 1);
  }
}

// The change that an exchange is said to make is what the whole tree's cost changes by, and heights, boxes
// and parents stay right.
TEST(ExchangeSearch, PredictsTheChangeOfTheWholeCost) {
  std::mt19937 random(7);
  for (const auto build : {build_minimal_tree<Bounds>, build_free_tree<Bounds>}) {
    const Mesh mesh = random_mesh(150, 11);
    const std::vector<Bounds> bounds = normalized_bounds(mesh.geometry());
    WorkingTree<Bounds> tree(build(bounds), bounds);
    ExchangeSearch<Bounds> search(tree);
    const Region whole = cut_into_regions(tree, ~0u).front();
    int made = 0;
    for (int i = 0; i < 4000; ++i) {
      const Child child = whole.children[random() % whole.children.size()];
      const std::uint32_t other = whole.blocks[random() % whole.blocks.size()];
      if (tree[other].is_leaf_block != child.is_triangle) continue;
      const int place = static_cast<int>(random() % 4u);
      if (place > tree[other].count) continue;
      const Child partner =
          place < tree[other].count ? tree.child(other, place) : Child{kNoIndex, child.is_triangle};
      const Exchange exchange{child, partner, tree.parent_of(child), other};
      const double change = search.cost_change(exchange, whole);
      if (std::isinf(change)) continue;
      const double before = cost_of(tree);
      tree.apply(exchange, whole.root);
      const WorkingTree<Bounds> anew(tree.topology(), bounds);
      ASSERT_NEAR(cost_of(anew) - before, change, 1e-5);
      for (std::uint32_t b = 0; b < tree.size(); ++b) {
        ASSERT_EQ(tree[b].height, anew[b].height);
        ASSERT_EQ(tree[b].parent, anew[b].parent);
        for (int k = 0; k < 3; ++k) ASSERT_EQ(tree[b].box.lo[k], anew[b].box.lo[k]);
      }
      ++made;
    }
    EXPECT_GT(made, 500);
  }
}

TEST(Imaginary, AShareNeverDeepensATreeBeyondWhatAFileMayHold) {
  for (const double share : {0.001, 0.01, 0.03, 0.05, 0.08, 0.1, 0.15}) {
    for (const std::uint32_t n : {100u, 300u, 900u, 4000u}) {
      EXPECT_LE(statistics_of(nested(n), {share}, Effort::fast).depth, kMaxDepth);
    }
  }
}

TEST(Imaginary, AShareIsNeverExceededAndEachTreeIsSound) {
  const Mesh mesh = sheet(30);
  std::uint64_t blocks = 0;
  for (const double share : {0.001, 0.01, 0.05, 0.1, 0.3}) {
    const TreeStatistics statistics = statistics_of(mesh, {share}, Effort::fast);
    EXPECT_LE(statistics.imaginary_fraction, share);
    EXPECT_EQ(statistics.leaf_nodes, mesh.triangles.size());
    EXPECT_GE(statistics.leaf_blocks + statistics.internal_blocks, blocks);
    blocks = statistics.leaf_blocks + statistics.internal_blocks;
  }
}

}  // namespace
}  // namespace tandem::build
