// Tests what the checker says of source vertices.
#include <gtest/gtest.h>

#include <algorithm>

#include "hostile_file.h"
#include "level_oracle.h"

namespace tandem::test {
namespace {

using enum Status;

Bytes refittable() {
  return Bytes(make_refittable_file(random_mesh(30, 1)));
}

const Attack kRangeAttacks[] = {
    {"a source vertex past the end", kSourceVertexMismatch,
     [](Bytes& f) { f.source_vertices()[4] = static_cast<std::uint32_t>(f.header().source_vertices); }},
    {"source vertex 2^32 - 1", kSourceVertexMismatch, [](Bytes& f) { f.source_vertices()[0] = kNoIndex; }},
    {"fewer source vertices than are named", kSourceVertexMismatch,
     [](Bytes& f) { --f.header().source_vertices; }},
    {"no source vertices", kBadHeader, [](Bytes& f) { f.header().source_vertices = 0; }},
    {"2^32 source vertices", kBadHeader,
     [](Bytes& f) { f.header().source_vertices = std::uint64_t{1} << 32; }},
};

TEST(CheckRefit, NamesVerticesOutOfRangeInAQuickCheckToo) {
  expect_all_named(refittable(), kRangeAttacks, [](Status) { return false; });
  EXPECT_EQ(refittable().check(CheckDepth::quick).status, kOk);
}

const Attack kDoubles[] = {
    {"two vertices with one source vertex", kSourceVertexMismatch,
     [](Bytes& f) { f.source_vertices()[7] = f.source_vertices()[3]; }},
};

TEST(CheckRefit, NoTwoVerticesHaveOneSourceVertexWhichAQuickCheckBelieves) {
  expect_all_named(refittable(), kDoubles, [](Status) { return true; });
}

TEST(CheckRefit, AcceptsTheSampleAndShowsItsSection) {
  const Bytes file = refittable();
  const CheckResult result = file.check();
  ASSERT_EQ(result.status, kOk) << name(result.status);
  const LevelView level = result.asset.level();
  EXPECT_EQ(defect_of(level), nullptr);
  EXPECT_EQ(result.asset.header->source_vertices, 90u);
  ASSERT_NE(level.source_vertices, nullptr);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    // Triangle t of the file is source face f of the mesh, whose corners are points 3 f to 3 f + 2.
    for (std::uint32_t k = 0; k < 3; ++k)
      EXPECT_EQ(level.source_vertices[level.topology[t].vertex[k]], 3 * level.triangles[t].source_face() + k);
  }
  const Bytes plain = sample();
  const CheckResult without = plain.check();
  EXPECT_EQ(without.asset.header->source_vertices, 0u);
  EXPECT_EQ(without.asset.level().source_vertices, nullptr);
}

TEST(CheckRefit, OfEqualVerticesTheFirstIsTheSource) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.add({1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  const Bytes file(make_refittable_file(mesh));
  const LevelView level = file.check().asset.level();
  ASSERT_EQ(level.vertex_count, 4u);
  std::vector<std::uint32_t> sources(level.source_vertices, level.source_vertices + 4);
  std::sort(sources.begin(), sources.end());
  EXPECT_EQ(sources, (std::vector<std::uint32_t>{0, 1, 2, 4}));
}

std::vector<Piece>::iterator find_piece(std::vector<Piece>& pieces, SectionKind kind) {
  return std::find_if(pieces.begin(), pieces.end(), [&](const Piece& p) { return p.row.kind == kind; });
}

// Two triangles that touch at a point, which is one vertex or, with `apart`, two.
Bytes touching(bool apart, bool with_sources) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.add({0, 0, 0}, {-1, 0, 0}, {0, -1, 0});
  Bytes file(make_refittable_file(mesh));
  if (apart) {
    file.level().vertex_count = 6;
    for (std::uint32_t t = 0; t < 2; ++t) {
      for (std::uint32_t k = 0; k < 3; ++k) file.topology()[t].vertex[k] = 3 * t + k;
    }
  }
  std::vector<Piece> pieces = pieces_of(file);
  Piece& sources = *find_piece(pieces, SectionKind::source_vertices);
  if (apart) {
    const std::uint32_t all[6] = {0, 1, 2, 3, 4, 5};
    sources.row.count = 6;
    sources.bytes.assign(reinterpret_cast<const char*>(all), sizeof all);
  }
  if (!with_sources) {
    file.header().source_vertices = 0;
    std::erase_if(pieces, [](const Piece& p) { return p.row.kind >= SectionKind::source_vertices; });
  }
  return lay_out(file.header(), pieces);
}

TEST(CheckRefit, TwoVerticesMayLieAtOnePositionOnlyWhereTheyHaveSourceVertices) {
  EXPECT_EQ(touching(false, true).check().status, kOk);
  EXPECT_EQ(touching(false, false).check().status, kOk);
  EXPECT_EQ(touching(true, true).check().status, kOk);
  EXPECT_EQ(touching(true, false).check().status, kVertexMismatch);
  const Bytes file = touching(true, true);
  EXPECT_EQ(file.check().asset.level().vertex_count, 6u);
}

TEST(CheckRefit, CornersOfOneVertexLieAtOnePositionEverywhere) {
  Bytes file = refittable();
  std::uint32_t* last = file.topology()[29].vertex;
  last[2] = last[1];
  EXPECT_EQ(file.check_sealed(), kVertexMismatch);
}

// The file after a change of its sections and header.
template <typename Change>
Status status_after_change(const Change& change) {
  Bytes file = refittable();
  std::vector<Piece> pieces = pieces_of(file);
  change(pieces, file.header());
  return lay_out(file.header(), pieces).check().status;
}

void cut_words(Piece& piece, std::size_t count) {
  piece.row.count = count;
  piece.bytes.resize(count * sizeof(std::uint32_t));
}

TEST(CheckRefit, SourceVerticesBelongToTopology) {
  using Pieces = std::vector<Piece>;
  constexpr auto kSources = SectionKind::source_vertices;
  const auto without = [](SectionKind kind) {
    return [=](Pieces& p, FileHeader&) { p.erase(find_piece(p, kind)); };
  };
  EXPECT_EQ(status_after_change([](Pieces&, FileHeader&) {}), kOk);
  EXPECT_EQ(status_after_change([](Pieces& p, FileHeader&) { std::reverse(p.begin(), p.end()); }), kOk);
  EXPECT_EQ(status_after_change(without(kSources)), kBadHeader);  // which says that there are some
  EXPECT_EQ(status_after_change([&](Pieces& p, FileHeader& header) {
              without(kSources)(p, header);
              header.source_vertices = 0;
            }),
            kOk);
  EXPECT_EQ(status_after_change(without(SectionKind::oriented_blocks)), kOk);
  EXPECT_EQ(status_after_change([&](Pieces& p, FileHeader&) { cut_words(*find_piece(p, kSources), 89); }),
            kBadLevel);
  EXPECT_EQ(status_after_change([&](Pieces& p, FileHeader&) { cut_words(*find_piece(p, kSources), 0); }),
            kBadLevel);
  EXPECT_EQ(status_after_change([&](Pieces& p, FileHeader&) { ++find_piece(p, kSources)->row.level; }),
            kUnknownSection);
  EXPECT_EQ(status_after_change([&](Pieces& p, FileHeader&) { p.push_back(*find_piece(p, kSources)); }),
            kSectionDuplicated);
  EXPECT_EQ(status_after_change([&](Pieces& p, FileHeader&) { find_piece(p, kSources)->bytes += '\0'; }),
            kSectionSizeMismatch);
}

// Nobody can know whether a vertex is row 3 or row 200 of an array.
TEST(CheckRefit, EverySealedChangeIsFoundOrHarmless) {
  Bytes file = refittable();
  const Section section = file.section(SectionKind::source_vertices);
  for_each_sealed_change(
      file, section.offset, section.offset + section.bytes, {0x01u, 0x02u, 0x80u, 0xFFu},
      [&](const CheckResult& result) { EXPECT_EQ(defect_of(result.asset.level()), nullptr); });
  EXPECT_EQ(file.check_sealed(), kOk);
}

TEST(CheckRefit, RejectsTruncatedAtEveryByte) {
  Bytes file(make_refittable_file(random_mesh(6, 2)));
  for (std::size_t size = 0; size < file.size(); ++size)
    ASSERT_NE(Bytes(file.data(), size).check().status, kOk) << size;
}

}  // namespace
}  // namespace tandem::test
