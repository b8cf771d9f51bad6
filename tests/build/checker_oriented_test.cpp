// Tests what the checker says of oriented blocks.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "hostile_file.h"
#include "level_oracle.h"

namespace tandem::test {
namespace {

using enum Status;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

int real_nodes(const OrientedBlock& block) {
  int real = 0;
  while (real < kNodesPerBlock && block.half_extent[0][real] >= 0) ++real;
  return real;
}

OrientedBlock& leaf_block(Bytes& file) {
  OrientedBlock* block = file.oriented_blocks();
  while (!block->is_leaf_block()) ++block;
  return *block;
}

OrientedBlock& block_with_imaginary_node(Bytes& file) {
  OrientedBlock* block = file.oriented_blocks();
  while (real_nodes(*block) == kNodesPerBlock) ++block;
  return *block;
}

OrientedBlock& turned_block(Bytes& file) {
  OrientedBlock* block = file.oriented_blocks();
  while (block->rotation == kNoRotation) ++block;
  return *block;
}

// Changes boxes of a block and makes its size right.
template <typename Change>
std::function<void(Bytes&)> in_block(OrientedBlock& (*pick)(Bytes&), const Change& change) {
  return [=](Bytes& file) {
    OrientedBlock& block = pick(file);
    change(block);
    block.size = oriented_size(block);
  };
}

OrientedBlock& root(Bytes& file) {
  return file.oriented_blocks()[0];
}

const Attack kBlockAttacks[] = {
    {"the child of another block", kOrientedBlockMismatch, [](Bytes& f) { ++root(f).first_below; }},
    {"the root below the root", kOrientedBlockMismatch, [](Bytes& f) { root(f).first_below = 0; }},
    {"a child past the end", kOrientedBlockMismatch,
     [](Bytes& f) { root(f).first_below = f.level().block_count; }},
    {"an internal block as a leaf block", kOrientedBlockMismatch,
     [](Bytes& f) { root(f).first_below |= OrientedBlock::kIsLeafBlock; }},
    {"a leaf block as an internal block", kOrientedBlockMismatch,
     [](Bytes& f) { leaf_block(f).first_below &= ~OrientedBlock::kIsLeafBlock; }},
    {"another triangle", kOrientedBlockMismatch, [](Bytes& f) { ++leaf_block(f).first_below; }},
    {"a triangle past the end", kOrientedBlockMismatch,
     [](Bytes& f) { leaf_block(f).first_below = OrientedBlock::kIsLeafBlock | 30; }},
    {"blocks that change places", kOrientedBlockMismatch,
     [](Bytes& f) { std::swap(f.oriented_blocks()[1], f.oriented_blocks()[2]); }},
    {"no rotation at all", kBadRotation,
     [](Bytes& f) {
       root(f).rotation = {kQuaternionOffset << 16 | kQuaternionOffset,
                           kQuaternionOffset << 16 | kQuaternionOffset};
     }},
    {"a part of -2048", kBadRotation, [](Bytes& f) { root(f).rotation.wx &= 0xFFFF0000u; }},
    {"a part of 2048", kBadRotation,
     [](Bytes& f) { root(f).rotation.yz = (root(f).rotation.yz & 0xFFFFu) | 4096u << 16; }},
    {"a part of 63487", kBadRotation, [](Bytes& f) { leaf_block(f).rotation.yz |= 0xFFFFu; }},
    {"the inverse rotation", kTriangleOutsideOrientedBox,
     [](Bytes& f) {
       BlockRotation& rotation = turned_block(f).rotation;
       const float w = quaternion_part(rotation, 0), x = quaternion_part(rotation, 1),
                   y = quaternion_part(rotation, 2), z = quaternion_part(rotation, 3);
       rotation = rotation_near(w, -x, -y, -z);
     }},
    {"another size", kBadOrientedBox, [](Bytes& f) { root(f).size *= 1.0000002f; }},
    {"size NaN", kBadOrientedBox, [](Bytes& f) { root(f).size = std::nanf(""); }},
    {"a negative size", kBadOrientedBox, [](Bytes& f) { leaf_block(f).size *= -1; }},
    {"centre NaN", kBadOrientedBox, in_block(root, [](OrientedBlock& b) { b.centre[1][0] = std::nanf(""); })},
    {"centre infinite", kBadOrientedBox,
     in_block(leaf_block, [](OrientedBlock& b) { b.centre[2][0] = -kInfinity; })},
    {"half-extent infinite", kBadOrientedBox,
     in_block(root, [](OrientedBlock& b) { b.half_extent[0][1] = kInfinity; })},
    {"half-extent NaN", kBadOrientedBox,
     in_block(leaf_block, [](OrientedBlock& b) { b.half_extent[0][0] = std::nanf(""); })},
    {"a negative half-extent", kBadOrientedBox,
     in_block(root, [](OrientedBlock& b) { b.half_extent[2][0] *= -1; })},
    {"half-extents that reach too far", kBadOrientedBox,
     in_block(root, [](OrientedBlock& b) { b.half_extent[0][0] = 3; })},
    {"a centre too far", kBadOrientedBox,
     in_block(leaf_block, [](OrientedBlock& b) { b.centre[0][0] = -3; })},
    {"a real node made imaginary", kBadOrientedBox,
     in_block(root,
              [](OrientedBlock& b) {
                for (int k = 0; k < 3; ++k) b.centre[k][0] = 0, b.half_extent[k][0] = kImaginaryHalfExtent;
              })},
    {"an imaginary node made real", kBadOrientedBox,
     in_block(block_with_imaginary_node,
              [](OrientedBlock& b) {
                for (int k = 0; k < 3; ++k) b.half_extent[k][3] = 0;
              })},
    {"imaginary along two axes", kBadOrientedBox,
     in_block(block_with_imaginary_node, [](OrientedBlock& b) { b.half_extent[1][3] = 1; })},
    {"imaginary with a centre", kBadOrientedBox,
     in_block(block_with_imaginary_node, [](OrientedBlock& b) { b.centre[0][3] = 1; })},
    {"imaginary with a centre of -0", kBadOrientedBox,
     in_block(block_with_imaginary_node, [](OrientedBlock& b) { b.centre[0][3] = -0.0f; })},
    {"imaginary with NaN", kBadOrientedBox,
     in_block(block_with_imaginary_node, [](OrientedBlock& b) { b.half_extent[2][3] = std::nanf(""); })},
    {"a box of another node", kTriangleOutsideOrientedBox,
     in_block(root, [](OrientedBlock& b) { std::swap(b.centre[0][0], b.centre[0][1]); })},
    {"an empty box", kTriangleOutsideOrientedBox,
     in_block(leaf_block, [](OrientedBlock& b) { b.half_extent[0][0] = 0; })},
};

TEST(CheckOriented, NamesHostileBlocksAndAQuickCheckAllButTrianglesOutside) {
  expect_all_named(sample(), kBlockAttacks,
                   [](Status status) { return status == kTriangleOutsideOrientedBox; });
  EXPECT_EQ(sample().check(CheckDepth::quick).status, kOk);
}

// The file after a change of its section of oriented blocks.
template <typename Change>
CheckResult check_changed(const Change& change) {
  Bytes file = sample();
  std::vector<Piece> pieces = pieces_of(file);
  std::size_t oriented = 0;
  while (pieces[oriented].row.kind != SectionKind::oriented_blocks) ++oriented;
  change(pieces, oriented);
  return lay_out(file.header(), pieces).check();
}

void cut(Piece& piece, std::size_t count) {
  piece.row.count = count;
  piece.bytes.resize(count * sizeof(OrientedBlock));
}

TEST(CheckOriented, TheSectionMayBeLeftOutOrLieAnywhere) {
  using Pieces = std::vector<Piece>;
  EXPECT_EQ(check_changed([](Pieces&, std::size_t) {}).status, kOk);
  EXPECT_EQ(
      check_changed([](Pieces& p, std::size_t at) { p.erase(p.begin() + static_cast<int>(at)); }).status,
      kOk);
  EXPECT_EQ(check_changed([](Pieces& p, std::size_t) { std::reverse(p.begin(), p.end()); }).status, kOk);

  Bytes file = sample();
  Pieces pieces = pieces_of(file);
  std::erase_if(pieces, [](const Piece& p) { return p.row.kind == SectionKind::oriented_blocks; });
  const Bytes without = lay_out(file.header(), pieces);
  EXPECT_EQ(without.check().asset.level().oriented_blocks, nullptr);
  EXPECT_NE(file.check().asset.level().oriented_blocks, nullptr);
}

TEST(CheckOriented, NamesSectionsThatAreNone) {
  using Pieces = std::vector<Piece>;
  EXPECT_EQ(check_changed([](Pieces& p, std::size_t at) { cut(p[at], 0); }).status, kBadLevel);
  EXPECT_EQ(check_changed([](Pieces& p, std::size_t at) { cut(p[at], p[at].row.count - 1); }).status,
            kBadLevel);
  EXPECT_EQ(check_changed([](Pieces& p, std::size_t at) { cut(p[at], p[at].row.count + 1); }).status,
            kBadLevel);
  EXPECT_EQ(check_changed([](Pieces& p, std::size_t at) { ++p[at].row.count; }).status, kSectionSizeMismatch);
  EXPECT_EQ(check_changed([](Pieces& p, std::size_t at) { p[at].bytes += '\0'; }).status,
            kSectionSizeMismatch);
  EXPECT_EQ(check_changed([](Pieces& p, std::size_t at) { p[at].row.level = 1; }).status, kUnknownSection);
  EXPECT_EQ(check_changed([](Pieces& p, std::size_t at) { p.push_back(p[at]); }).status, kSectionDuplicated);
}

TEST(CheckOriented, EachLevelHasItsOwnBlocksOrNone) {
  const std::vector<Mesh> meshes = random_levels(40, 2, 1);
  const Mesh &fine = meshes[0], &coarse = meshes[1];
  const build::Tree fine_tree = build::build_tree(fine.geometry(), build::Imaginary::minimal);
  const build::Tree coarse_tree = build::build_tree(coarse.geometry(), build::Imaginary::minimal);
  const auto fine_blocks = build::orient_blocks(fine.geometry(), fine_tree, build::Effort::standard);
  const auto coarse_blocks = build::orient_blocks(coarse.geometry(), coarse_tree, build::Effort::standard);
  const std::vector<std::uint32_t> face(40, 0);
  const build::SourcePart part = {"all", "", 0, 1};
  for (int which = 0; which < 4; ++which) {
    build::AssetLevel levels[] = {{fine.geometry(), face, &fine_tree, {}, 0},
                                  {coarse.geometry(), face, &coarse_tree, {}, 0.5}};
    if ((which & 1) != 0) levels[0].oriented_blocks = fine_blocks;
    if ((which & 2) != 0) levels[1].oriented_blocks = coarse_blocks;
    Bytes file(assembled(levels, 1, {&part, 1}));
    const CheckResult result = file.check();
    ASSERT_EQ(result.status, kOk) << name(result.status);
    for (const std::uint32_t i : {0u, 1u}) {
      const LevelView level = result.asset.level(i);
      ASSERT_EQ(level.oriented_blocks != nullptr, (which >> i & 1) != 0);
      if (level.oriented_blocks != nullptr) {
        EXPECT_EQ(defect_of_oriented_blocks(level), nullptr);
      }
    }
    if (which != 2) continue;
    file.section(SectionKind::oriented_blocks).level =
        0;  // the coarse level's blocks, said to be the fine one's
    EXPECT_EQ(file.check_sealed(), kBadLevel);
  }
}

// The triangles below each node of each oriented block.
struct Below {
  std::uint32_t block, first, end;
  int node;
};

std::uint32_t add_below(const LevelView& level, std::uint32_t number, std::vector<Below>& out) {
  const OrientedBlock& block = level.oriented_blocks[number];
  std::uint32_t end = 0;
  for (int i = 0; i < real_nodes(block); ++i) {
    const std::uint32_t below =
        (block.first_below & ~OrientedBlock::kIsLeafBlock) + static_cast<std::uint32_t>(i);
    const std::size_t at = out.size();
    out.push_back({number, below, below + 1, i});
    if (!block.is_leaf_block()) {
      const std::uint32_t past = add_below(level, below, out);
      out[at].first = out[at + 1].first;
      out[at].end = past;
    }
    end = out[at].end;
  }
  return end;
}

// The triangles lie in this range along an axis of a block.
struct Range {
  long double lowest = HUGE_VALL, highest = -HUGE_VALL;
};

Range range_of(const LevelView& level, const Below& below, int k) {
  const ScaledRotation rotation = scaled_rotation(level.oriented_blocks[below.block].rotation);
  Range range;
  for (std::uint32_t t = below.first; t < below.end; ++t) {
    for (const Triangle::Corner& corner : level.triangles[t].corner) {
      long double at = 0;
      for (int i = 0; i < 3; ++i)
        at += static_cast<long double>(rotation.scaled[i][k]) * static_cast<long double>(corner.position[i]);
      at /= static_cast<long double>(rotation.squared_length);
      range.lowest = std::fmin(range.lowest, at);
      range.highest = std::fmax(range.highest, at);
    }
  }
  return range;
}

// The smallest float that is larger.
float above(long double x) {
  const auto near = static_cast<float>(x);
  return static_cast<long double>(near) > x ? near : std::nextafter(near, kInfinity);
}

// Each box of a turned block, made as small as float32 lets it, is accepted, and refused if a bound comes any
// closer.
TEST(CheckOriented, ABoxMayBeTightButNoUnitTighter) {
  Bytes file(make_file(random_mesh(200, 3)));
  const LevelView level = file.check().asset.level();
  std::vector<Below> all;
  ASSERT_EQ(add_below(level, 0, all), 200u);
  int of_leaves = 0, of_internal = 0;
  for (const Below& below : all) {
    OrientedBlock& block = file.oriented_blocks()[below.block];
    if (block.rotation == kNoRotation) continue;
    const OrientedBlock original = block;
    ++(block.is_leaf_block() ? of_leaves : of_internal);
    for (int k = 0; k < 3; ++k) {
      const auto expect = [&](float centre, float half_extent, Status status) {
        block.centre[k][below.node] = centre;
        block.half_extent[k][below.node] = half_extent;
        block.size = oriented_size(block);
        EXPECT_EQ(file.check_sealed(), status) << below.block << ", node " << below.node << ", axis " << k;
        if (status != kOk) {
          EXPECT_EQ(file.check().where, below.block);
        }
        block = original;
      };
      // From the middle, and beside it on either side: one bound is then tighter than the other. The
      // checker's margin is less than 2^-48 of the mesh, and a unit of these half-extents is more.
      const Range range = range_of(level, below, k);
      const auto middle = static_cast<float>((range.lowest + range.highest) / 2);
      for (const float centre :
           {middle, std::nextafter(middle, kInfinity), std::nextafter(middle, -kInfinity)}) {
        const long double c = centre;
        const float least = above(std::fmax(range.highest - c, c - range.lowest) + 0x1p-48L);
        expect(centre, least, kOk);
        expect(centre, std::nextafter(std::nextafter(least, 0.0f), 0.0f), kTriangleOutsideOrientedBox);
      }
    }
  }
  EXPECT_GT(of_leaves, 50);
  EXPECT_GT(of_internal, 10);
}

// A point, and a box that ends before it by less than float64 tells.
TEST(CheckOriented, NoRoundingDecides) {
  std::mt19937_64 random(1);
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() >> 32) % n; };
  const auto any_parts = [&] { return (1 + below(4095)) | (1 + below(4095)) << 16; };
  int close = 0;
  for (int i = 0; i < 3000; ++i) {
    std::array<float, 3> point;
    for (float& x : point) x = static_cast<float>(below(1u << 24)) * 0x1p-24f;
    Mesh mesh;
    mesh.add(point, point, point);
    Bytes file(make_file(mesh));
    const LevelView level = file.check().asset.level();
    OrientedBlock& block = root(file);
    block.rotation = {any_parts(), any_parts()};
    const auto k = static_cast<int>(below(3));
    long double off = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const long double at = range_of(level, {0, 0, 1, 0}, axis).lowest;
      block.centre[axis][0] = static_cast<float>(at);
      block.half_extent[axis][0] = 0x1p-20f;
      if (axis == k) off = std::fabs(at - static_cast<long double>(block.centre[k][0]));
    }
    float& half_extent = block.half_extent[k][0];
    half_extent = std::nextafter(static_cast<float>(off), 0.0f);
    if (off - static_cast<long double>(half_extent) < 0x1p-60L) continue;  // more than long double tells
    close += off - static_cast<long double>(half_extent) < 0x1p-53L;
    block.size = oriented_size(block);
    EXPECT_EQ(file.check_sealed(), kTriangleOutsideOrientedBox);
    half_extent = above(off + 0x1p-48L);
    block.size = oriented_size(block);
    EXPECT_EQ(file.check_sealed(), kOk);
  }
  EXPECT_GT(close, 100);
}

// In the mesh's own axes the block's own boxes are large enough, and no smaller ones are.
TEST(CheckOriented, TheBoxesOfABlockDoInTheAxesOfTheMesh) {
  for (int k = 0; k < 3; ++k) {
    Bytes file = sample();
    const Block* block = file.blocks();
    while (!block->is_leaf_block() || block->index[0] != 0) ++block;
    OrientedBlock* oriented = file.oriented_blocks();
    while (oriented->first_below != OrientedBlock::kIsLeafBlock) ++oriented;
    std::memcpy(oriented->centre, block->centre, sizeof block->centre);
    std::memcpy(oriented->half_extent, block->half_extent, sizeof block->half_extent);
    oriented->rotation = kNoRotation;
    oriented->size = oriented_size(*oriented);
    EXPECT_EQ(file.check_sealed(), kOk);
    float& half_extent = oriented->half_extent[k][0];
    half_extent = std::nextafter(half_extent, 0.0f);
    oriented->size = oriented_size(*oriented);
    EXPECT_EQ(file.check_sealed(), kTriangleOutsideOrientedBox);
  }
}

// A centre that is moved by more than a box has to spare.
TEST(CheckOriented, ACentreMayNotBeMoved) {
  Bytes file(make_file(random_mesh(200, 4)));
  std::vector<Below> all;
  add_below(file.check().asset.level(), 0, all);
  for (const Below& below : all) {
    OrientedBlock& block = file.oriented_blocks()[below.block];
    const OrientedBlock original = block;
    for (int k = 0; k < 3; ++k) {
      for (const float way : {-1.0f, 1.0f}) {
        const float spare = 0x1p-18f * block.half_extent[k][below.node] + 0x1p-20f;
        block.centre[k][below.node] += way * spare;
        EXPECT_EQ(file.check_sealed(), kTriangleOutsideOrientedBox);
        block = original;
      }
    }
  }
}

void expect_sound(const Mesh& mesh, const char* what) {
  constexpr auto kMinimal = build::Imaginary::minimal, kFree = build::Imaginary::free;
  for (const auto& [effort, imaginary] :
       {std::pair(build::Effort::fast, kMinimal), std::pair(build::Effort::standard, kFree),
        std::pair(build::Effort::best, kMinimal)}) {
    const Bytes file(make_file(mesh, imaginary, effort));
    const CheckResult result = file.check();
    ASSERT_EQ(result.status, kOk) << what << ": " << name(result.status) << " " << result.where;
    EXPECT_EQ(defect_of_oriented_blocks(result.asset.level()), nullptr) << what;
  }
}

Mesh moved(Mesh mesh, float scale, float offset) {
  for (auto& point : mesh.points) {
    for (float& x : point) x = scale * x + offset;
  }
  return mesh;
}

TEST(CheckOriented, AcceptsTheBlocksOfHostileMeshes) {
  for (const std::uint32_t n : {1u, 5u, 17u, 60u}) {
    const Mesh mesh = random_mesh(n, n);
    expect_sound(mesh, "plain");
    for (const float scale : {1e-44f, 1e-41f, 1e-38f, 1e-20f, 1e20f, 1e37f, 3e38f}) {
      expect_sound(moved(mesh, scale, 0), "scaled");
      expect_sound(moved(mesh, scale, -scale / 2), "around the origin");
    }
    for (const float offset : {1e3f, 1e6f, -1e30f})
      expect_sound(moved(mesh, 1, offset), "far from the origin");
    Mesh flat = mesh, line = mesh, one = mesh;
    for (auto& point : flat.points) point[1] = 0.25f;
    for (auto& point : line.points) point = {point[0], point[0], -point[0]};
    for (auto& point : one.points) point = {0.1f, 0.2f, -0.3f};
    expect_sound(flat, "flat");
    expect_sound(line, "a line");
    expect_sound(one, "one point");
    Mesh far = mesh;
    far.add({3e38f, -3e38f, 3e38f}, {-3e38f, 3e38f, 1e-44f}, {1e-44f, -1e-44f, 0});
    expect_sound(far, "of all magnitudes");
  }
}

}  // namespace
}  // namespace tandem::test
