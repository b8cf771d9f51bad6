// What the checker says of topology.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "hostile_file.h"
#include "topology_oracle.h"

namespace tandem {
namespace {

using test::Attack;
using test::Bytes;
using test::lay_out;
using test::make_file;
using test::Mesh;
using test::Piece;
using test::pieces_of;

/// A closed tetrahedron, a square of two triangles, and three triangles at one edge, each far from the others
/// so that the tree keeps them together: 4, 2 and 3 triangles.
Bytes sample() {
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
    {"a vertex past the end", Status::kBadTopology,
     [](Bytes& f) { f.topology()[4].vertex[1] = f.level().vertex_count; }},
    {"vertex 2^32 - 1", Status::kBadTopology, [](Bytes& f) { f.topology()[8].vertex[2] = kNoIndex; }},
    {"an unknown flag", Status::kBadTopology, [](Bytes& f) { f.topology()[3].flags |= 128; }},
    {"the highest flag", Status::kBadTopology, [](Bytes& f) { f.topology()[3].flags |= 1u << 31; }},
    {"one vertex less", Status::kBadTopology, [](Bytes& f) { --f.level().vertex_count; }},
    {"a component that begins past the end", Status::kBadTopology,
     [](Bytes& f) { f.components()[2].first_triangle = 9; }},
    {"components out of order", Status::kBadTopology,
     [](Bytes& f) { std::swap(f.components()[0], f.components()[1]); }},
    {"a component twice", Status::kBadTopology, [](Bytes& f) { f.components()[1] = f.components()[0]; }},
    {"a component of too many triangles", Status::kBadTopology,
     [](Bytes& f) { f.components()[1].triangle_count = 10; }},
    {"an unknown flag of a component", Status::kBadTopology, [](Bytes& f) { f.components()[0].flags |= 2; }},
    {"a component's reserved word", Status::kBadTopology, [](Bytes& f) { f.components()[0].reserved = 1; }},

    {"one vertex more", Status::kVertexOrder, [](Bytes& f) { ++f.level().vertex_count; }},
    {"vertices that change their numbers", Status::kVertexOrder,
     [](Bytes& f) {
       for (std::uint32_t t = 0; t < 9; ++t) {
         for (std::uint32_t& v : f.topology()[t].vertex) v = v < 2 ? 1 - v : v;
       }
     }},
    {"the first vertex is not 0", Status::kVertexOrder,
     [](Bytes& f) {
       for (std::uint32_t t = 0; t < 9; ++t) {
         for (std::uint32_t& v : f.topology()[t].vertex) ++v;
       }
       ++f.level().vertex_count;
     }},

    {"one vertex at two positions", Status::kVertexMismatch,
     [](Bytes& f) { f.topology()[8].vertex[2] = f.topology()[8].vertex[1]; }},
    {"two vertices at one position", Status::kVertexMismatch,
     [](Bytes& f) {  // the corners of the last triangle that others have too, as vertices of its own
       std::uint32_t next = 0, *last = f.topology()[8].vertex;
       for (std::uint32_t t = 0; t < 8; ++t) {
         for (const std::uint32_t v : f.topology()[t].vertex) next = std::max(next, v + 1);
       }
       for (int k = 0; k < 3; ++k) last[k] = next++;
       f.level().vertex_count = next;
     }},

    {"a boundary that is none", Status::kEdgeMismatch,
     [](Bytes& f) { members(f, 4)[2]->flags |= kBoundaryEdge0 << 1; }},
    {"no boundary where one is", Status::kEdgeMismatch,
     [](Bytes& f) { members(f, 2)[0]->flags &= ~(7 * kBoundaryEdge0); }},
    {"no many triangles where they are", Status::kEdgeMismatch,
     [](Bytes& f) { members(f, 3)[1]->flags &= ~(7 * kManyTriangles0); }},
    {"many triangles where two are", Status::kEdgeMismatch,
     [](Bytes& f) { members(f, 4)[0]->flags |= kManyTriangles0; }},
    {"many triangles and a boundary too", Status::kEdgeMismatch,
     [](Bytes& f) { members(f, 3)[2]->flags |= 7 * kBoundaryEdge0; }},

    {"an open component said to be closed", Status::kComponentMismatch,
     [](Bytes& f) { component(f, 2).flags = kClosedComponent; }},
    {"a closed component said to be open", Status::kComponentMismatch,
     [](Bytes& f) { component(f, 4).flags = 0; }},
    {"a triangle more", Status::kComponentMismatch, [](Bytes& f) { ++component(f, 2).triangle_count; }},
    {"another first triangle", Status::kComponentMismatch,
     [](Bytes& f) { ++f.components()[2].first_triangle; }},
    {"an open level said to be closed", Status::kComponentMismatch,
     [](Bytes& f) { f.level().flags = kClosedLevel; }},
    {"one triangle turned, and still closed", Status::kComponentMismatch,
     [](Bytes& f) { members(f, 4)[0]->flags ^= kTurned; }},

    {"one triangle turned", Status::kBadWinding,
     [](Bytes& f) {
       members(f, 4)[0]->flags ^= kTurned;
       component(f, 4).flags = 0;
     }},
    {"one of two turned, the later one", Status::kBadWinding,
     [](Bytes& f) { members(f, 2)[1]->flags ^= kTurned; }},
    {"inside out", Status::kBadWinding, [](Bytes& f) { turn_all(f, 4); }},
    {"an open component turned as a whole", Status::kBadWinding, [](Bytes& f) { turn_all(f, 2); }},
    {"the larger part turned", Status::kBadWinding, [](Bytes& f) { turn_all(f, 3); }},
};

bool is_believed(Status status) {
  return status != Status::kBadTopology && status != Status::kOk;
}

TEST(CheckTopology, NamesHostileTopology) {
  for (const Attack& attack : kAttacks) {
    Bytes file = sample();
    attack.apply(file);
    const Status status = file.check_sealed();
    EXPECT_EQ(status, attack.expected) << attack.what << ": " << name(status);
  }
}

TEST(CheckTopology, AQuickCheckFindsWhatLeavesArrays) {
  for (const Attack& attack : kAttacks) {
    Bytes file = sample();
    attack.apply(file);
    seal(file.data(), file.size());
    EXPECT_EQ(file.check(CheckDepth::quick).status,
              is_believed(attack.expected) ? Status::kOk : attack.expected)
        << attack.what;
  }
}

TEST(CheckTopology, AcceptsTheSampleAndSaysWhatItHolds) {
  const Bytes file = sample();
  const CheckResult result = file.check();
  ASSERT_EQ(result.status, Status::kOk) << name(result.status);
  const LevelView level = result.asset.level();
  EXPECT_EQ(test::defect_of_topology(level), nullptr);
  EXPECT_EQ(level.component_count, 3u);
  EXPECT_EQ(level.vertex_count, 4u + 4u + 5u);
  EXPECT_FALSE(level.closed);
}

// A hostile writer computes the hash too: what passes is what the oracle finds.
TEST(CheckTopology, EverySealedChangeIsFoundOrHarmless) {
  Bytes file = sample();
  int passed = 0;
  for (const SectionKind kind : {SectionKind::levels, SectionKind::topology, SectionKind::components}) {
    const Section section = file.section(kind);
    for (std::uint64_t i = section.offset; i < section.offset + section.bytes; ++i) {
      for (const unsigned change : {0x01u, 0x02u, 0x03u, 0x08u, 0x10u, 0x80u, 0xFFu}) {
        file.data()[i] ^= static_cast<unsigned char>(change);
        seal(file.data(), file.size());
        const CheckResult result = file.check();
        if (result.status == Status::kOk) {
          ++passed;
          EXPECT_EQ(test::defect_of_topology(result.asset.level()), nullptr) << i << " ^ " << change;
        }
        file.data()[i] ^= static_cast<unsigned char>(change);
      }
    }
  }
  EXPECT_LE(passed, 4);  // one of the three triangles at an edge may be turned: nothing joins their windings
  EXPECT_EQ(file.check_sealed(), Status::kOk);
}

TEST(CheckTopology, OfTwoHalvesTheFirstIsNotTurned) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.add({1, 0, 0}, {0, 1, 0}, {1, 1, 0});
  Bytes file(make_file(mesh));
  EXPECT_EQ(file.check_sealed(), Status::kOk);
  ASSERT_EQ(file.topology()[0].flags & kTurned, 0u);
  ASSERT_EQ(file.topology()[1].flags & kTurned, 1u);
  for (const int t : {0, 1}) file.topology()[t].flags ^= kTurned;
  EXPECT_EQ(file.check_sealed(), Status::kBadWinding);
}

TEST(CheckTopology, MinusZeroIsNoOtherPosition) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.add({-0.0f, 0, -0.0f}, {-1, 0, 0}, {0, -1, 0});
  Bytes file(make_file(mesh));
  EXPECT_EQ(file.check_sealed(), Status::kOk);
  EXPECT_EQ(file.level().vertex_count, 5u);
  for (int k = 0; k < 3; ++k) file.topology()[1].vertex[k] = 3 + static_cast<std::uint32_t>(k);
  file.level().vertex_count = 6;
  EXPECT_EQ(file.check_sealed(), Status::kVertexMismatch);
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
  ASSERT_EQ(mesh.triangles.size(), test::kTrianglesOfDeepestTree);
  Bytes file(make_file(mesh, test::deepest_tree(mesh)));
  EXPECT_EQ(file.check_sealed(), Status::kOk);
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
    EXPECT_EQ(file.check_sealed(), Status::kBadWinding);
  }
  for (const std::uint32_t t : sheet) file.topology()[t].flags &= ~kTurned;
  EXPECT_EQ(file.check_sealed(), Status::kOk);
}

std::vector<Piece>::iterator find(std::vector<Piece>& pieces, SectionKind kind) {
  return std::find_if(pieces.begin(), pieces.end(), [&](const Piece& p) { return p.row.kind == kind; });
}

// The file after a change of its sections.
template <typename Change>
Status status_after(const Change& change) {
  Bytes file = sample();
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
  EXPECT_EQ(status_after([](Pieces&) {}), Status::kOk);
  EXPECT_EQ(status_after([](Pieces& p) { std::reverse(p.begin(), p.end()); }), Status::kOk);
  EXPECT_EQ(status_after([&](Pieces& p) { p.erase(find(p, kTopology)); }), Status::kBadLevel);
  EXPECT_EQ(status_after([&](Pieces& p) { p.erase(find(p, kComponents)); }), Status::kBadLevel);
  const auto without = [&](Pieces& p) { p.erase(find(p, kTopology)), p.erase(find(p, kComponents)); };
  EXPECT_EQ(status_after(without), Status::kBadLevel);  // the level says that it has vertices
  EXPECT_EQ(status_after([&](Pieces& p) {
              without(p);
              const Level level = {9, 0, 0, 0, 0, 0, 0};
              auto& bytes = find(p, SectionKind::levels)->bytes;
              constexpr std::size_t kFrom = offsetof(Level, vertex_count);
              bytes.replace(kFrom, sizeof level - kFrom, reinterpret_cast<const char*>(&level) + kFrom,
                            sizeof level - kFrom);
            }),
            Status::kOk);
  for (const std::size_t count : {0u, 8u, 10u})
    EXPECT_EQ(status_after([&](Pieces& p) { cut(*find(p, kTopology), count); }), Status::kBadLevel) << count;
  EXPECT_EQ(status_after([&](Pieces& p) { cut(*find(p, kComponents), 0); }), Status::kBadLevel);
  EXPECT_EQ(status_after([&](Pieces& p) { cut(*find(p, kComponents), 10); }), Status::kBadLevel);
  EXPECT_EQ(status_after([&](Pieces& p) { cut(*find(p, kComponents), 2); }), Status::kComponentMismatch);
  EXPECT_EQ(status_after([&](Pieces& p) {  // a component of no triangles
              const SurfaceComponent none = {8, 0, kClosedComponent, 0};
              Piece& piece = *find(p, kComponents);
              cut(piece, 4);
              piece.bytes.replace(3 * sizeof none, sizeof none, reinterpret_cast<const char*>(&none),
                                  sizeof none);
            }),
            Status::kComponentMismatch);
  EXPECT_EQ(status_after([&](Pieces& p) { ++find(p, kTopology)->row.level; }), Status::kUnknownSection);
  EXPECT_EQ(status_after([&](Pieces& p) { p.push_back(*find(p, kComponents)); }), Status::kSectionDuplicated);
  EXPECT_EQ(status_after([&](Pieces& p) { find(p, kTopology)->bytes += '\0'; }),
            Status::kSectionSizeMismatch);
}

TEST(CheckTopology, AFileWithoutHasNullPointers) {
  const Mesh mesh = test::random_mesh(5, 1);
  const build::Tree tree = build::build_tree(mesh.geometry());
  const std::vector<std::uint32_t> face(5, 0);
  const build::SourcePart part = {"all", "", 0, 1};
  build::AssetSource source;
  source.source_faces = 1;
  source.parts = {&part, 1};
  const build::AssetLevel row{mesh.geometry(), face, &tree, {}, 0};
  const Bytes file(build::assemble(source, {&row, 1}));
  const CheckResult result = file.check();
  ASSERT_EQ(result.status, Status::kOk);
  const LevelView level = result.asset.level();
  EXPECT_EQ(level.topology, nullptr);
  EXPECT_EQ(level.components, nullptr);
  EXPECT_EQ(level.vertex_count + level.component_count, 0u);
  EXPECT_FALSE(level.closed);
}

}  // namespace
}  // namespace tandem
