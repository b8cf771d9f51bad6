// Tests what the checker says of topology.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "hostile_file.h"
#include "level_oracle.h"
#include "sample_asset.h"

namespace tandem::test {
namespace {

using enum Status;

/// A closed tetrahedron, a square of two triangles, and three triangles at one edge, each far from the others
/// so that the tree keeps them together: 4, 2 and 3 triangles.
Bytes surfaces() {
  Mesh mesh;
  mesh.add({0, 0, 0}, {0, 1, 0}, {1, 0, 0});
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  mesh.add({0, 0, 0}, {0, 0, 1}, {0, 1, 0});
  mesh.add({1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  mesh.add({10, 0, 0}, {11, 0, 0}, {10, 1, 0});
  mesh.add({11, 0, 0}, {11, 1, 0}, {10, 1, 0});
  for (const float y : {1.0f, 2.0f, 3.0f}) mesh.add({20, 0, 0}, {21, 0, 0}, {20, y, 1 + y * y});
  return Bytes(make_file(mesh));
}

/// The component with so many triangles.
SurfaceComponent& component(Bytes& file, std::uint32_t triangles) {
  SurfaceComponent* found = file.components();
  while (found->triangle_count != triangles) ++found;
  return *found;
}

/// The topology of the triangles of the component, which is known by its number of triangles.
std::vector<TriangleTopology*> members(Bytes& file, std::uint32_t triangles) {
  std::vector<TriangleTopology*> out;
  for (std::uint32_t t = 0; t < file.level().triangle_count; ++t) {
    const float x = file.triangles()[t].corner[0].position[0];
    if ((triangles == 4 && x < 5) || (triangles == 2 && x > 5 && x < 15) || (triangles == 3 && x > 15))
      out.push_back(&file.topology()[t]);
  }
  EXPECT_EQ(out.size(), triangles);
  return out;
}

void turn_all(Bytes& file, std::uint32_t triangles) {
  for (TriangleTopology* triangle : members(file, triangles)) triangle->flags ^= kTurned;
}

const Attack kAttacks[] = {
    {"a vertex past the end", kBadTopology,
     [](Bytes& f) { f.topology()[4].vertex[1] = f.level().vertex_count; }},
    {"vertex 2^32 - 1", kBadTopology, [](Bytes& f) { f.topology()[8].vertex[2] = kNoIndex; }},
    {"an unknown flag", kBadTopology, [](Bytes& f) { f.topology()[3].flags |= 128; }},
    {"the highest flag", kBadTopology, [](Bytes& f) { f.topology()[3].flags |= 1u << 31; }},
    {"one vertex less", kBadTopology, [](Bytes& f) { --f.level().vertex_count; }},
    {"a component that begins past the end", kBadTopology,
     [](Bytes& f) { f.components()[2].first_triangle = 9; }},
    {"components out of order", kBadTopology,
     [](Bytes& f) { std::swap(f.components()[0], f.components()[1]); }},
    {"a component twice", kBadTopology, [](Bytes& f) { f.components()[1] = f.components()[0]; }},
    {"a component of too many triangles", kBadTopology,
     [](Bytes& f) { f.components()[1].triangle_count = 10; }},
    {"an unknown flag of a component", kBadTopology, [](Bytes& f) { f.components()[0].flags |= 2; }},
    {"a component's reserved word", kBadTopology, [](Bytes& f) { f.components()[0].reserved = 1; }},

    {"one vertex more", kVertexOrder, [](Bytes& f) { ++f.level().vertex_count; }},
    {"vertices that change their numbers", kVertexOrder,
     [](Bytes& f) {
       for (std::uint32_t t = 0; t < 9; ++t) {
         for (std::uint32_t& v : f.topology()[t].vertex) v = v < 2 ? 1 - v : v;
       }
     }},
    {"the first vertex is not 0", kVertexOrder,
     [](Bytes& f) {
       for (std::uint32_t t = 0; t < 9; ++t) {
         for (std::uint32_t& v : f.topology()[t].vertex) ++v;
       }
       ++f.level().vertex_count;
     }},

    {"one vertex at two positions", kVertexMismatch,
     [](Bytes& f) { f.topology()[8].vertex[2] = f.topology()[8].vertex[1]; }},
    {"two vertices at one position", kVertexMismatch,
     [](Bytes& f) {  // the corners of the last triangle that others have too, as vertices of its own
       std::uint32_t next = 0, *last = f.topology()[8].vertex;
       for (std::uint32_t t = 0; t < 8; ++t) {
         for (const std::uint32_t v : f.topology()[t].vertex) next = std::max(next, v + 1);
       }
       for (int k = 0; k < 3; ++k) last[k] = next++;
       f.level().vertex_count = next;
     }},

    {"a boundary that is none", kEdgeMismatch,
     [](Bytes& f) { members(f, 4)[2]->flags |= kBoundaryEdge0 << 1; }},
    {"no boundary where one is", kEdgeMismatch,
     [](Bytes& f) { members(f, 2)[0]->flags &= ~(7 * kBoundaryEdge0); }},
    {"no many triangles where they are", kEdgeMismatch,
     [](Bytes& f) { members(f, 3)[1]->flags &= ~(7 * kManyTriangles0); }},
    {"many triangles where two are", kEdgeMismatch,
     [](Bytes& f) { members(f, 4)[0]->flags |= kManyTriangles0; }},
    {"many triangles and a boundary too", kEdgeMismatch,
     [](Bytes& f) { members(f, 3)[2]->flags |= 7 * kBoundaryEdge0; }},

    {"an open component said to be closed", kComponentMismatch,
     [](Bytes& f) { component(f, 2).flags = kClosedComponent; }},
    {"a closed component said to be open", kComponentMismatch, [](Bytes& f) { component(f, 4).flags = 0; }},
    {"a triangle more", kComponentMismatch, [](Bytes& f) { ++component(f, 2).triangle_count; }},
    {"another first triangle", kComponentMismatch, [](Bytes& f) { ++f.components()[2].first_triangle; }},
    {"an open level said to be closed", kComponentMismatch, [](Bytes& f) { f.level().flags = kClosedLevel; }},
    {"one triangle turned, and still closed", kComponentMismatch,
     [](Bytes& f) { members(f, 4)[0]->flags ^= kTurned; }},

    {"one triangle turned", kBadWinding,
     [](Bytes& f) {
       members(f, 4)[0]->flags ^= kTurned;
       component(f, 4).flags = 0;
     }},
    {"one of two turned, the later one", kBadWinding, [](Bytes& f) { members(f, 2)[1]->flags ^= kTurned; }},
    {"inside out", kBadWinding, [](Bytes& f) { turn_all(f, 4); }},
    {"an open component turned as a whole", kBadWinding, [](Bytes& f) { turn_all(f, 2); }},
    {"the larger part turned", kBadWinding, [](Bytes& f) { turn_all(f, 3); }},
};

TEST(CheckTopology, NamesHostileTopologyAndAQuickCheckWhatLeavesArrays) {
  expect_all_named(surfaces(), kAttacks, [](Status status) { return status != kBadTopology; });
}

TEST(CheckTopology, AcceptsTheSampleAndSaysWhatItHolds) {
  const Bytes file = surfaces();
  const CheckResult result = file.check();
  ASSERT_EQ(result.status, kOk) << name(result.status);
  const LevelView level = result.asset.level();
  EXPECT_EQ(defect_of_topology(level), nullptr);
  EXPECT_EQ(level.component_count, 3u);
  EXPECT_EQ(level.vertex_count, 4u + 4u + 5u);
  EXPECT_FALSE(level.closed);
}

// A hostile writer computes the hash too: what passes is what the oracle finds.
TEST(CheckTopology, EverySealedChangeIsFoundOrHarmless) {
  Bytes file = surfaces();
  int passed = 0;
  for (const SectionKind kind : {SectionKind::levels, SectionKind::topology, SectionKind::components}) {
    const Section section = file.section(kind);
    for_each_sealed_change(file, section.offset, section.offset + section.bytes,
                           {0x01u, 0x02u, 0x03u, 0x08u, 0x10u, 0x80u, 0xFFu}, [&](const CheckResult& result) {
                             ++passed;
                             EXPECT_EQ(defect_of_topology(result.asset.level()), nullptr);
                           });
  }
  EXPECT_LE(passed, 4);  // one of the three triangles at an edge may be turned: nothing joins their windings
  EXPECT_EQ(file.check_sealed(), kOk);
}

TEST(CheckTopology, OfTwoHalvesTheFirstIsNotTurned) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.add({1, 0, 0}, {0, 1, 0}, {1, 1, 0});
  Bytes file(make_file(mesh));
  EXPECT_EQ(file.check_sealed(), kOk);
  ASSERT_EQ(file.topology()[0].flags & kTurned, 0u);
  ASSERT_EQ(file.topology()[1].flags & kTurned, 1u);
  for (const int t : {0, 1}) file.topology()[t].flags ^= kTurned;
  EXPECT_EQ(file.check_sealed(), kBadWinding);
}

TEST(CheckTopology, MinusZeroIsNoOtherPosition) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.add({-0.0f, 0, -0.0f}, {-1, 0, 0}, {0, -1, 0});
  Bytes file(make_file(mesh));
  EXPECT_EQ(file.check_sealed(), kOk);
  EXPECT_EQ(file.level().vertex_count, 5u);
  for (int k = 0; k < 3; ++k) file.topology()[1].vertex[k] = 3 + static_cast<std::uint32_t>(k);
  file.level().vertex_count = 6;
  EXPECT_EQ(file.check_sealed(), kVertexMismatch);
}

TEST(CheckTopology, ASideThatBelongsToNoEdgeHasNoBits) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 0, 0});
  Bytes file(make_file(mesh));
  ASSERT_EQ(file.check_sealed(), kOk);
  const std::uint32_t(&v)[3] = file.topology()[0].vertex;
  std::uint32_t side = 0;
  while (v[side] != v[(side + 1) % 3]) ++side;
  const std::uint32_t sound = file.topology()[0].flags;
  for (const std::uint32_t bit : {kBoundaryEdge0, kManyTriangles0}) {
    file.topology()[0].flags = sound | bit << side;
    EXPECT_EQ(file.check_sealed(), kEdgeMismatch);
    file.topology()[0].flags = sound | kTurned | bit << side;
    EXPECT_EQ(file.check_sealed(), kEdgeMismatch);
  }
}

// Any windings of a sheet but those that agree, beside a strip of five triangles that no windings make agree.
// The triangles lie in no order that helps.
TEST(CheckTopology, WindingsMayDisagreeOnlyWhereNoneAgree) {
  Mesh mesh;
  const auto at = [](int i, int j) {
    return std::array<float, 3>{static_cast<float>(i), static_cast<float>(j), 0};
  };
  for (int i = 0; i < 18; ++i) {
    for (int j = 0; j < 21; ++j) {
      mesh.add(at(i, j), at(i + 1, j), at(i, j + 1));
      mesh.add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  mesh.triangles.pop_back();
  const std::array<float, 3> ring[] = {{50, 0, 0}, {51, 0, 1}, {52, 1, 0}, {51, 2, 2}, {50, 1, 1}};
  for (int i = 0; i < 5; ++i) mesh.add(ring[i], ring[(i + 1) % 5], ring[(i + 2) % 5]);
  std::mt19937 random(1);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
  ASSERT_EQ(mesh.triangles.size(), kTrianglesOfDeepestTree);
  Bytes file(make_file(mesh, deepest_tree(mesh)));
  EXPECT_EQ(file.check_sealed(), kOk);
  std::vector<std::uint32_t> sheet;
  for (std::uint32_t t = 0; t < file.level().triangle_count; ++t) {
    if (file.triangles()[t].corner[0].position[0] < 40) sheet.push_back(t);
  }
  ASSERT_EQ(sheet.size(), 755u);
  for (int round = 0; round < 20; ++round) {
    for (const std::uint32_t t : sheet) {
      file.topology()[t].flags &= ~kTurned;
      file.topology()[t].flags |= random() % 5 < 2 ? kTurned : 0;
    }
    EXPECT_EQ(file.check_sealed(), kBadWinding);
  }
  for (const std::uint32_t t : sheet) file.topology()[t].flags &= ~kTurned;
  EXPECT_EQ(file.check_sealed(), kOk);
}

std::vector<Piece>::iterator find(std::vector<Piece>& pieces, SectionKind kind) {
  return std::find_if(pieces.begin(), pieces.end(), [&](const Piece& p) { return p.row.kind == kind; });
}

// The file after a change of its sections.
template <typename Change>
Status status_after(const Change& change) {
  Bytes file = surfaces();
  std::vector<Piece> pieces = pieces_of(file);
  change(pieces);
  return lay_out(file.header(), pieces).check().status;
}

void cut(Piece& piece, std::size_t count) {
  piece.row.count = count;
  piece.bytes.resize(count * 16);
}

TEST(CheckTopology, BothSectionsAreThereOrNone) {
  using Pieces = std::vector<Piece>;
  constexpr auto kTopology = SectionKind::topology, kComponents = SectionKind::components;
  EXPECT_EQ(status_after([](Pieces&) {}), kOk);
  EXPECT_EQ(status_after([](Pieces& p) { std::reverse(p.begin(), p.end()); }), kOk);
  EXPECT_EQ(status_after([&](Pieces& p) { p.erase(find(p, kTopology)); }), kBadLevel);
  EXPECT_EQ(status_after([&](Pieces& p) { p.erase(find(p, kComponents)); }), kBadLevel);
  const auto without = [&](Pieces& p) { p.erase(find(p, kTopology)), p.erase(find(p, kComponents)); };
  EXPECT_EQ(status_after(without), kBadLevel);  // the level says that it has vertices
  EXPECT_EQ(status_after([&](Pieces& p) {
              without(p);
              const Level level = {9, 0, 0, 0, 0, 0, 0};
              auto& bytes = find(p, SectionKind::levels)->bytes;
              constexpr std::size_t kFrom = offsetof(Level, vertex_count);
              bytes.replace(kFrom, sizeof level - kFrom, reinterpret_cast<const char*>(&level) + kFrom,
                            sizeof level - kFrom);
            }),
            kOk);
  for (const std::size_t count : {0u, 8u, 10u})
    EXPECT_EQ(status_after([&](Pieces& p) { cut(*find(p, kTopology), count); }), kBadLevel) << count;
  EXPECT_EQ(status_after([&](Pieces& p) { cut(*find(p, kComponents), 0); }), kBadLevel);
  EXPECT_EQ(status_after([&](Pieces& p) { cut(*find(p, kComponents), 10); }), kBadLevel);
  EXPECT_EQ(status_after([&](Pieces& p) { cut(*find(p, kComponents), 2); }), kComponentMismatch);
  EXPECT_EQ(status_after([&](Pieces& p) {  // a component of no triangles
              const SurfaceComponent none = {8, 0, kClosedComponent, 0};
              Piece& piece = *find(p, kComponents);
              cut(piece, 4);
              piece.bytes.replace(3 * sizeof none, sizeof none, reinterpret_cast<const char*>(&none),
                                  sizeof none);
            }),
            kComponentMismatch);
  EXPECT_EQ(status_after([&](Pieces& p) { ++find(p, kTopology)->row.level; }), kUnknownSection);
  EXPECT_EQ(status_after([&](Pieces& p) { p.push_back(*find(p, kComponents)); }), kSectionDuplicated);
  EXPECT_EQ(status_after([&](Pieces& p) { find(p, kTopology)->bytes += '\0'; }), kSectionSizeMismatch);
}

TEST(CheckTopology, AFileWithoutHasNullPointers) {
  const Mesh mesh = random_mesh(5, 1);
  const build::Tree tree = build::build_tree(mesh.geometry());
  const std::vector<std::uint32_t> face(5, 0);
  const build::SourcePart part = {"all", "", 0, 1};
  const build::AssetLevel row{mesh.geometry(), face, &tree, {}, 0};
  const Bytes file(assembled({&row, 1}, 1, {&part, 1}));
  const CheckResult result = file.check();
  ASSERT_EQ(result.status, kOk);
  const LevelView level = result.asset.level();
  EXPECT_EQ(level.topology, nullptr);
  EXPECT_EQ(level.components, nullptr);
  EXPECT_EQ(level.vertex_count + level.component_count, 0u);
  EXPECT_FALSE(level.closed);
}

Section& section_of(Bytes& file, SectionKind kind, std::uint32_t level) {
  std::size_t i = 0;
  while (file.section(i).kind != kind || file.section(i).level != level) ++i;
  return file.section(i);
}

// The section of each kind of level `level`, in the order in which they lie.
std::vector<SectionKind> kinds_in_order(Bytes& file, std::uint32_t level, std::size_t& first) {
  std::vector<SectionKind> kinds;
  for (std::size_t i = 1; i < file.header().section_count - 3; ++i) {
    if (file.section(i).level != level) continue;
    if (kinds.empty()) first = i;
    kinds.push_back(file.section(i).kind);
  }
  return kinds;
}

TEST(CheckLevels, EachIsOnePieceOfTheFile) {
  Bytes file(make_file_of_levels(random_levels(30, 3, 1)));
  const CheckResult result = file.check();
  ASSERT_EQ(result.status, kOk) << name(result.status);
  ASSERT_EQ(result.asset.levels.size(), 3u);
  const std::vector<SectionKind> expected = {SectionKind::blocks,          SectionKind::triangles,
                                             SectionKind::oriented_blocks, SectionKind::topology,
                                             SectionKind::components,      SectionKind::source_vertices};
  for (std::uint32_t i = 0; i < 3; ++i) {
    std::size_t first = 0;
    EXPECT_EQ(kinds_in_order(file, i, first), expected);
    EXPECT_EQ(first, 1 + 6 * i);
    EXPECT_EQ(result.asset.level(i).error_bound, i);
    EXPECT_EQ(result.asset.level(i).triangle_count, i == 0 ? 30u : i == 1 ? 15u : 8u);
    EXPECT_EQ(defect_of(result.asset.level(i)), nullptr);
  }
}

TEST(CheckLevels, LieWithinTheBoundsOfTheFinest) {
  for (int k = 0; k < 3; ++k) {
    for (const float way : {-1.0f, 1.0f}) {
      std::vector<Mesh> meshes = random_levels(30, 3, 2);
      float edge = meshes[0].points[0][k];
      for (const auto& point : meshes[0].points) edge = way * std::max(way * edge, way * point[k]);
      float& moved = meshes[2].points[meshes[2].triangles[7][1]][k];
      moved = edge;
      EXPECT_EQ(Bytes(make_file_of_levels(meshes)).check().status, kOk) << k << " " << way;
      moved = std::nextafter(edge, 2 * way);
      const CheckResult beyond = Bytes(make_file_of_levels(meshes)).check();
      EXPECT_EQ(beyond.status, kLevelOutsideBounds) << k << " " << way;
      EXPECT_EQ(beyond.where, 2u);
    }
  }
}

TEST(CheckLevels, NamesWhatIsAmiss) {
  const Bytes sound(make_file_of_levels(random_levels(30, 3, 3)));
  const auto status = [&](const std::function<void(Bytes&)>& damage) {
    Bytes file(sound);
    damage(file);
    return file.check_sealed();
  };
  const auto row = [](Bytes& f, int i) -> Level& { return (&f.level())[i]; };
  EXPECT_EQ(status([](Bytes&) {}), kOk);
  EXPECT_EQ(status([&](Bytes& f) { row(f, 2).error_bound = 1; }), kOk);
  EXPECT_EQ(status([&](Bytes& f) { row(f, 2).error_bound = 0.5; }), kBadLevel);
  EXPECT_EQ(status([&](Bytes& f) { row(f, 1).error_bound = -1; }), kBadLevel);
  EXPECT_EQ(status([&](Bytes& f) { row(f, 2).error_bound = std::numeric_limits<double>::infinity(); }),
            kBadLevel);
  EXPECT_EQ(status([&](Bytes& f) { ++row(f, 1).triangle_count; }), kBadLevel);
  EXPECT_EQ(status([&](Bytes& f) { std::swap(row(f, 1), row(f, 2)); }), kBadLevel);
  EXPECT_EQ(status([](Bytes& f) { section_of(f, SectionKind::triangles, 1).level = 2; }), kSectionDuplicated);
  EXPECT_EQ(status([](Bytes& f) { section_of(f, SectionKind::triangles, 2).level = 3; }), kUnknownSection);
  EXPECT_EQ(status([](Bytes& f) {
              std::swap(section_of(f, SectionKind::components, 1).level,
                        section_of(f, SectionKind::topology, 2).level);
            }),
            kSectionDuplicated);
}

TEST(CheckLevels, RejectsTruncatedAtEveryByte) {
  Bytes file(make_file_of_levels(random_levels(6, 2, 4)));
  for (std::size_t size = 0; size < file.size(); ++size)
    ASSERT_NE(Bytes(file.data(), size).check().status, kOk) << size;
}

TEST(CheckLevels, EverySealedSingleByteChangeIsRejectedOrHarmless) {
  Bytes file(make_file_of_levels(random_levels(9, 2, 5)));
  for_each_sealed_change(file, 16, file.size(), {0x01u, 0x80u}, [](const CheckResult& result) {
    for (std::uint32_t level = 0; level < 2; ++level)
      EXPECT_EQ(defect_of(result.asset.level(level)), nullptr);
  });
}

}  // namespace
}  // namespace tandem::test
