#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <random>

#include "hostile_file.h"
#include "level_oracle.h"

namespace tandem::test {
namespace {

using enum Status;

/// The first leaf block, and the first that has an imaginary node.
Block& leaf_block(Bytes& file) {
  Block* block = file.blocks();
  while (!block->is_leaf_block()) ++block;
  return *block;
}

Block& imaginary_leaf(Bytes& file) {
  Block* block = file.blocks();
  while (!block->is_leaf_block() || block->kind[3] != NodeKind::imaginary) ++block;
  return *block;
}

std::vector<std::uint32_t> children_of(const Block& block) {
  std::vector<std::uint32_t> children;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if (block.kind[i] == NodeKind::internal) children.push_back(block.index[i]);
  }
  return children;
}

// Lays the blocks in another order, order[i] in place i, and the triangles as their leaves then come.
void reorder(Bytes& file, const std::vector<std::uint32_t>& order) {
  std::vector<std::uint32_t> place(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  const std::vector<Block> blocks(file.blocks(), file.blocks() + order.size());
  const std::vector<Triangle> triangles(file.triangles(), file.triangles() + file.level().triangle_count);
  std::uint32_t next_triangle = 0;
  for (std::uint32_t b = 0; b < order.size(); ++b) {
    Block& block = file.blocks()[b] = blocks[order[b]];
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (block.kind[i] == NodeKind::internal) block.index[i] = place[block.index[i]];
      if (block.kind[i] != NodeKind::leaf) continue;
      file.triangles()[next_triangle] = triangles[block.index[i]];
      block.index[i] = next_triangle++;
    }
  }
}

// An order of blocks, each after its parent. Of the blocks whose parents have their places, `take` picks the
// next one, given their number.
std::vector<std::uint32_t> parents_first(Bytes& file, const std::function<std::size_t(std::size_t)>& take) {
  std::vector<std::uint32_t> order, ready = {0};
  while (!ready.empty()) {
    const auto next = ready.begin() + static_cast<std::ptrdiff_t>(take(ready.size()));
    order.push_back(*next);
    ready.erase(next);
    for (const std::uint32_t child : children_of(file.blocks()[order.back()])) ready.push_back(child);
  }
  return order;
}

TEST(Check, AcceptsWhatTheBuilderWrites) {
  for (const std::uint32_t n : {1u, 4u, 5u, 30u, 1000u}) {
    const Bytes file(make_file(random_mesh(n, n)));
    const CheckResult result = file.check();
    ASSERT_EQ(result.status, kOk) << n << " " << name(result.status);
    EXPECT_EQ(result.asset.level().triangle_count, n);
    EXPECT_EQ(result.asset.name_of(result.asset.parts[1]), "right");
    EXPECT_EQ(result.asset.path_of(result.asset.parts[0]), "scene/left");
    EXPECT_EQ(result.asset.provenance, "{\"tool\":\"test\"}");
  }
}

TEST(Check, RejectsTruncatedAtEveryByte) {
  Bytes file = sample();
  for (std::size_t size = 0; size < file.size(); ++size) {
    const Bytes cut(file.data(), size);
    const Status status = cut.check().status;
    ASSERT_NE(status, kOk) << size;
    if (size >= 8) {
      ASSERT_EQ(status, kTruncated) << size;
    }
  }
}

TEST(Check, RejectsEverySingleByteChange) {
  const Bytes original(make_file(random_mesh(4, 1)));
  Bytes file(original);
  for (std::size_t i = 0; i < file.size(); ++i) {
    for (unsigned change = 1; change < 256; ++change) {
      file.data()[i] ^= static_cast<unsigned char>(change);
      ASSERT_NE(file.check().status, kOk) << i << " ^ " << change;
      file.data()[i] ^= static_cast<unsigned char>(change);
    }
  }
  EXPECT_EQ(file.check().status, kOk);
}

// A hostile writer computes the hash too. Whatever the checker lets pass must be safe to walk.
TEST(Check, EverySealedSingleByteChangeIsRejectedOrHarmless) {
  Bytes file = sample();
  for_each_sealed_change(file, 16, file.size(), {0x01u, 0x04u, 0x80u, 0xFFu}, [&](const CheckResult& result) {
    EXPECT_EQ(result.asset.level().triangle_count, 30u);
    EXPECT_EQ(defect_of(result.asset.level()), nullptr);
    for (const Part& part : result.asset.parts) EXPECT_LE(result.asset.name_of(part).size(), file.size());
  });
}

TEST(Check, RejectsMisalignedBytes) {
  Bytes file = sample();
  EXPECT_EQ(check(file.data() + 16, file.size() - 16).status, kMisaligned);
}

TEST(Check, NamesForeignFiles) {
  const auto status_of = [](std::string text) { return Bytes(text.data(), text.size()).check().status; };
  EXPECT_EQ(status_of("HIERARCHY\nROOT Hips\n{\n"), kBiovisionMotionCapture);
  EXPECT_EQ(status_of(""), kNotTandem);
  EXPECT_EQ(status_of("\x89"
                      "BV"),
            kNotTandem);
  EXPECT_EQ(status_of("OFF\n3 1 0\n"), kNotTandem);
  EXPECT_EQ(status_of("\x89"
                      "BVH\n\x1a\n and so on"),
            kDamagedByTextTransfer);
  EXPECT_EQ(status_of(std::string(500, 'x')), kNotTandem);
}

TEST(Check, RejectsTrailingBytes) {
  Bytes file = sample();
  std::string longer(reinterpret_cast<char*>(file.data()), file.size());
  longer += '\0';
  EXPECT_EQ(Bytes(longer.data(), longer.size()).check().status, kTrailingBytes);
}

void set_box(Block& block, int node, float centre, float half_extent) {
  for (int k = 0; k < 3; ++k) {
    block.centre[k][node] = centre;
    block.half_extent[k][node] = half_extent;
  }
}

const Attack kHeaderAttacks[] = {
    {"byte order", kWrongByteOrder, [](Bytes& f) { f.header().byte_order = 0x04030201; }},
    {"major version", kUnsupportedVersion, [](Bytes& f) { f.header().version_major = 2; }},
    {"minor version", kUnsupportedVersion, [](Bytes& f) { f.header().version_minor = 1; }},
    {"reserved byte", kBadHeader, [](Bytes& f) { f.header().reserved[15] = 1; }},
    {"no level", kBadHeader, [](Bytes& f) { f.header().level_count = 0; }},
    {"too many levels", kBadHeader, [](Bytes& f) { f.header().level_count = kMaxLevels + 1; }},
    {"levels that are not there", kBadLevel, [](Bytes& f) { f.header().level_count = 2; }},
    {"too many sections", kBadHeader, [](Bytes& f) { f.header().section_count = 0xFFFFFFFF; }},
    {"fewer sections", kBadGap, [](Bytes& f) { --f.header().section_count; }},
    {"no faces", kBadHeader, [](Bytes& f) { f.header().source_faces = 0; }},
    {"origin NaN", kBadHeader, [](Bytes& f) { f.header().origin[1] = std::nan(""); }},
    {"negative error", kBadHeader, [](Bytes& f) { f.header().rounding_error = -1; }},
    {"bounds too wide", kBoundsMismatch, [](Bytes& f) { f.header().upper[0] += 1; }},
    {"bounds NaN", kBoundsMismatch, [](Bytes& f) { f.header().lower[2] = std::nanf(""); }},
};

const Attack kSectionAttacks[] = {
    {"unknown kind", kUnknownSection, [](Bytes& f) { f.section(0).kind = static_cast<SectionKind>(77); }},
    {"kind 0", kUnknownSection, [](Bytes& f) { f.section(3).kind = static_cast<SectionKind>(0); }},
    {"level past the last", kUnknownSection, [](Bytes& f) { f.section(SectionKind::blocks).level = 1; }},
    {"level of a file section", kUnknownSection, [](Bytes& f) { f.section(SectionKind::parts).level = 1; }},
    {"offset off the grid", kSectionMisaligned, [](Bytes& f) { f.section(1).offset += 16; }},
    {"offset past the end", kSectionOutOfBounds,
     [](Bytes& f) { f.section(1).offset = 256 * f.header().file_bytes; }},
    {"offset near 2^64", kSectionOutOfBounds, [](Bytes& f) { f.section(1).offset = ~std::uint64_t{255}; }},
    {"bytes past the end", kSectionOutOfBounds, [](Bytes& f) { f.section(6).bytes = f.header().file_bytes; }},
    {"bytes near 2^64", kSectionOutOfBounds, [](Bytes& f) { f.section(6).bytes = ~std::uint64_t{0}; }},
    {"count whose product overflows", kSectionSizeMismatch,
     [](Bytes& f) { f.section(SectionKind::blocks).count += std::uint64_t{1} << 57; }},
    {"bytes no multiple", kSectionSizeMismatch, [](Bytes& f) { f.section(SectionKind::blocks).bytes -= 1; }},
    {"overlap", kSectionsOverlap,
     [](Bytes& f) { f.section(SectionKind::triangles).offset = f.section(SectionKind::blocks).offset; }},
    {"over the header", kSectionsOverlap, [](Bytes& f) { f.section(0).offset = 0; }},
    {"out of order", kBadGap, [](Bytes& f) { std::swap(f.section(1), f.section(2)); }},
    {"twice", kSectionDuplicated,
     [](Bytes& f) {
       f.section(SectionKind::strings) = {SectionKind::levels, 0, f.section(SectionKind::strings).offset, 32,
                                          1};
     }},
    {"a byte in a gap", kBadGap,
     [](Bytes& f) { f.data()[f.section(SectionKind::levels).offset + sizeof(Level)] = 1; }},
    {"a byte behind the last section", kBadGap, [](Bytes& f) { f.data()[f.size() - 1] = 1; }},
};

const Attack kLevelAttacks[] = {
    {"block count", kBadLevel, [](Bytes& f) { ++f.level().block_count; }},
    {"triangle count", kBadLevel, [](Bytes& f) { --f.level().triangle_count; }},
    {"more leaf blocks than blocks", kBadLevel, [](Bytes& f) { f.level().leaf_block_count = 1000; }},
    {"leaf blocks", kLeafCountMismatch, [](Bytes& f) { --f.level().leaf_block_count; }},
    {"depth", kDepthMismatch, [](Bytes& f) { ++f.level().depth; }},
    {"error bound of level 0", kBadLevel, [](Bytes& f) { f.level().error_bound = 1; }},
    {"error bound NaN", kBadLevel, [](Bytes& f) { f.level().error_bound = std::nan(""); }},
    {"an unknown flag", kBadLevel, [](Bytes& f) { f.level().flags |= 2; }},
    {"part name", kBadPart, [](Bytes& f) { f.parts()[0].name_bytes = 1000; }},
    {"part name overflow", kBadPart, [](Bytes& f) { f.parts()[1].name_offset = 0xFFFFFFFF; }},
    {"part path", kBadPart, [](Bytes& f) { f.parts()[1].path_offset = 1000; }},
    {"empty part name behind the strings", kBadPart,
     [](Bytes& f) {
       Part& part = f.parts()[0];
       part.name_bytes = 0;
       part.name_offset = static_cast<std::uint32_t>(f.section(SectionKind::strings).bytes) + 1;
     }},
    {"part name and path that are the whole strings", kBadPart,
     [](Bytes& f) {
       Part& part = f.parts()[0];
       part.name_offset = part.path_offset = 0;
       part.name_bytes = part.path_bytes = static_cast<std::uint32_t>(f.section(SectionKind::strings).bytes);
     }},
    {"strings one byte longer together than the section", kBadPart,
     [](Bytes& f) {
       Part& part = f.parts()[1];
       part.path_offset = 0;
       ++part.path_bytes;
     }},
    {"part gap", kBadPart, [](Bytes& f) { f.parts()[1].first_face += 1; }},
    {"part too long", kBadPart, [](Bytes& f) { f.parts()[1].face_count += 1; }},
    {"parts too short", kBadPart, [](Bytes& f) { f.parts()[1].face_count -= 1; }},
};

const Attack kTreeAttacks[] = {
    {"kind 3", kBadNodeKind, [](Bytes& f) { f.blocks()[0].kind[1] = static_cast<NodeKind>(3); }},
    {"imaginary first", kImaginaryBeforeReal, [](Bytes& f) { set_imaginary(leaf_block(f), 0); }},
    {"imaginary only", kEmptyBlock,
     [](Bytes& f) {
       for (int i = 0; i < 4; ++i) set_imaginary(f.blocks()[0], i);
     }},
    {"partial leaf block", kPartialLeafBlock, [](Bytes& f) { leaf_block(f).kind[1] = NodeKind::internal; }},
    {"partial leaf block at the root", kPartialLeafBlock,
     [](Bytes& f) { f.blocks()[0].kind[1] = NodeKind::leaf; }},
    {"imaginary with a box", kBadImaginaryNode, [](Bytes& f) { imaginary_leaf(f).half_extent[1][3] = 1; }},
    {"imaginary with NaN", kBadImaginaryNode,
     [](Bytes& f) { imaginary_leaf(f).centre[0][3] = std::nanf(""); }},
    {"imaginary with a centre of -0", kBadImaginaryNode,
     [](Bytes& f) { imaginary_leaf(f).centre[2][3] = -0.0F; }},
    {"imaginary with an index", kBadImaginaryNode, [](Bytes& f) { imaginary_leaf(f).index[3] = 0; }},
    {"box NaN", kBadBox, [](Bytes& f) { f.blocks()[0].centre[0][0] = std::nanf(""); }},
    {"box infinite", kBadBox,
     [](Bytes& f) { f.blocks()[0].half_extent[0][0] = std::numeric_limits<float>::infinity(); }},
    {"negative half-extent", kBadBox, [](Bytes& f) { f.blocks()[0].half_extent[2][0] *= -1; }},
    {"child past the end", kChildOutOfRange,
     [](Bytes& f) { f.blocks()[0].index[1] = f.level().block_count; }},
    {"child at 2^32 - 1", kChildOutOfRange, [](Bytes& f) { f.blocks()[0].index[1] = kNoIndex; }},
    {"cycle to the root", kChildNotAfterParent, [](Bytes& f) { f.blocks()[0].index[0] = 0; }},
    {"shared child", kChildShared, [](Bytes& f) { f.blocks()[0].index[1] = f.blocks()[0].index[0]; }},
    {"unreachable block", kBlockUnreachable,
     [](Bytes& f) {
       Block& root = f.blocks()[0];
       int last = 3;
       while (root.kind[last] == NodeKind::imaginary) --last;
       set_imaginary(root, last);
     }},
    {"unreachable block between others", kBlockUnreachable,
     [](Bytes& f) {  // the root's last child becomes the only one
       Block& root = f.blocks()[0];
       set_node(root, 0, box_of(root, 1), root.index[1], NodeKind::internal);
       for (int i = 1; i < kNodesPerBlock; ++i) set_imaginary(root, i);
     }},
    {"breadth first", kBlockOrder,
     [](Bytes& f) { reorder(f, parents_first(f, [](std::size_t) { return std::size_t{0}; })); }},
    {"the last child first", kBlockOrder,
     [](Bytes& f) { reorder(f, parents_first(f, [](std::size_t ready) { return ready - 1; })); }},
    {"children that change places in their parent", kBlockOrder,
     [](Bytes& f) {
       Block& root = f.blocks()[0];
       const Box box = box_of(root, 0);
       const std::uint32_t child = root.index[0];
       set_node(root, 0, box_of(root, 1), root.index[1], NodeKind::internal);
       set_node(root, 1, box, child, NodeKind::internal);
     }},
    {"triangle twice", kTriangleOrder, [](Bytes& f) { leaf_block(f).index[1] = 0; }},
    {"triangle past the end", kTriangleOrder, [](Bytes& f) { leaf_block(f).index[0] = 30; }},
    {"triangle left out", kLeafCountMismatch,
     [](Bytes& f) {
       std::uint32_t b = f.level().block_count - 1;
       int last = 3;
       while (f.blocks()[b].kind[last] == NodeKind::imaginary) --last;
       set_imaginary(f.blocks()[b], last);
     }},
    {"triangle NaN", kTriangleNotFinite,
     [](Bytes& f) { f.triangles()[7].corner[1].position[2] = std::nanf(""); }},
    {"triangle too far", kTriangleNotFinite,
     [](Bytes& f) { f.triangles()[7].corner[1].position[2] = 3.4028e38f; }},
    {"triangle outside its leaf by one float", kTriangleOutsideLeafBox,
     [](Bytes& f) {
       const Box box = box_of(leaf_block(f), 0);
       f.triangles()[0].corner[0].position[0] = std::nextafter(box.centre[0] + box.half_extent[0], 10.0f);
     }},
    {"child outside its parent", kChildOutsideParentBox,
     [](Bytes& f) { set_box(leaf_block(f), 0, 0.5f, 2); }},
    {"parent smaller by one float", kChildOutsideParentBox,
     [](Bytes& f) {
       float& h = f.blocks()[0].half_extent[1][0];
       h = std::nextafter(h, 0.0f);
     }},
    {"source face past the end", kBadFace, [](Bytes& f) { f.triangles()[3].corner[0].w = 30; }},
    {"part past the end", kBadFace, [](Bytes& f) { f.triangles()[3].corner[1].w = 2; }},
    {"face of another part", kBadFace, [](Bytes& f) { f.triangles()[3].corner[1].w ^= 1; }},
    {"reserved lane", kBadFace, [](Bytes& f) { f.triangles()[3].corner[2].w = 1; }},
};

TEST(Check, NamesHostileHeadersSectionsLevelsPartsAndTrees) {
  for (const std::span<const Attack> attacks :
       {std::span<const Attack>(kHeaderAttacks), {kSectionAttacks}, {kLevelAttacks}, {kTreeAttacks}})
    expect_all_named(sample(), attacks);
}

// One of all orders in which children come after their parents is right.
TEST(Check, AcceptsBlocksInDepthFirstOrderOnly) {
  std::mt19937 random(1);
  const Bytes original(make_file(random_mesh(24, 1)));  // 8 blocks
  int accepted = 0;
  for (int i = 0; i < 2000; ++i) {
    Bytes file(original);
    const std::vector<std::uint32_t> order =
        parents_first(file, [&](std::size_t ready) { return random() % ready; });
    std::vector<std::uint32_t> unchanged(order.size());
    std::iota(unchanged.begin(), unchanged.end(), 0u);
    reorder(file, order);
    const Status status = file.check_sealed();
    ASSERT_EQ(status, order == unchanged ? kOk : kBlockOrder) << name(status);
    if (order != unchanged) {
      const auto wrong = std::mismatch(order.begin(), order.end(), unchanged.begin()).first - order.begin();
      ASSERT_EQ(file.check().where, static_cast<std::uint64_t>(wrong));
    }
    accepted += status == kOk;
  }
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, 2000);
}

// The tree of 5 triangles is a root with two leaf blocks and room for a third child.
TEST(Check, NamesWhatIsWrongWithAChildForWhichNoBlockIsLeft) {
  const Bytes original(make_file(random_mesh(5, 1)));
  const auto expect_third_child = [&](std::uint32_t child, Status status, std::uint64_t where) {
    Bytes file(original);
    set_node(file.blocks()[0], 2, box_of(file.blocks()[0], 1), child, NodeKind::internal);
    EXPECT_EQ(file.check_sealed(), status) << name(file.check().status);
    EXPECT_EQ(file.check().where, where);
  };
  expect_third_child(0, kChildNotAfterParent, 0);
  expect_third_child(1, kChildShared, 1);
  expect_third_child(2, kChildShared, 2);
  expect_third_child(3, kChildOutOfRange, 0);
}

TEST(Check, FileSizeInTheHeaderMustBeTheFilesSize) {
  Bytes file = sample();
  file.header().file_bytes += 256;
  EXPECT_EQ(file.check().status, kTruncated);
  file.header().file_bytes = 16;
  EXPECT_EQ(file.check().status, kTruncated);
}

TEST(Check, TheFileEndsAtTheFirstMultipleOf256AfterTheLastSection) {
  Bytes file = sample();
  const Section& last = file.section(SectionKind::provenance);
  const std::size_t end = last.offset + last.bytes;
  ASSERT_LT(end, file.size());
  for (const std::size_t size : {end, end + 1, file.size() - 1, file.size() + 10, file.size() + 256}) {
    std::string bytes(reinterpret_cast<char*>(file.data()), file.size());
    bytes.resize(size, '\0');
    Bytes other(bytes.data(), bytes.size());
    other.header().file_bytes = size;
    EXPECT_EQ(other.check_sealed(), kBadGap) << size;
  }
}

TEST(Check, RejectsAFileWithoutParts) {
  const Mesh mesh = random_mesh(1, 1);
  const build::Tree tree = build::build_tree(mesh.geometry(), build::Imaginary::minimal);
  const std::vector<std::uint32_t> face = {0};
  const build::AssetLevel level{mesh.geometry(), face, &tree, {}, 0};
  const Bytes file(assembled({&level, 1}, 1, {}));
  EXPECT_EQ(file.check().status, kSectionMissing);
}

// A chain of blocks, each with one child, that is one block too deep.
TEST(Check, RejectsATreePastTheDepthLimit) {
  for (const std::uint32_t depth : {kMaxDepth, kMaxDepth + 1}) {
    Mesh mesh = random_mesh(1, 1);
    build::Tree tree = build::build_tree(mesh.geometry(), build::Imaginary::minimal);
    const Block leaf = tree.blocks[0];
    tree.blocks.assign(depth, Block{});
    tree.blocks.back() = leaf;
    for (std::uint32_t b = depth - 1; b-- > 0;) {
      for (int i = 1; i < kNodesPerBlock; ++i) set_imaginary(tree.blocks[b], i);
      set_node(tree.blocks[b], 0, box_of(leaf, 0), b + 1, NodeKind::internal);
    }
    tree.depth = depth;
    const std::vector<std::uint32_t> face = {0};
    const build::SourcePart part = {"", "", 0, 1};
    const build::AssetLevel level{mesh.geometry(), face, &tree, {}, 0};
    const Bytes file(assembled({&level, 1}, 1, {&part, 1}));
    EXPECT_EQ(file.check().status, depth <= kMaxDepth ? kOk : kTooDeep) << depth;
  }
}

TEST(Check, AcceptsSectionsInAnyOrderAndEmptyTextsAnywhereInTheStrings) {
  Bytes file = sample();
  std::swap(file.section(SectionKind::strings).kind, file.section(SectionKind::provenance).kind);
  const std::uint64_t end = file.section(SectionKind::strings).bytes;
  ASSERT_GT(end, 0u);
  for (const std::uint64_t offset : {std::uint64_t{0}, end}) {
    for (std::uint64_t i = 0; i < file.section(SectionKind::parts).count; ++i) {
      Part& part = file.parts()[i];
      part.name_bytes = part.path_bytes = 0;
      part.name_offset = part.path_offset = static_cast<std::uint32_t>(offset);
    }
    EXPECT_EQ(file.check_sealed(), kOk) << offset;
  }
}

}  // namespace
}  // namespace tandem::test
