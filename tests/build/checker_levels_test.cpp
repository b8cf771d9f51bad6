#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "oriented_oracle.h"
#include "sample_asset.h"
#include "topology_oracle.h"

namespace tandem {
namespace {

using test::Bytes;

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
  Bytes file(test::make_file_of_levels(test::random_levels(30, 3, 1)));
  const CheckResult result = file.check();
  ASSERT_EQ(result.status, Status::kOk) << name(result.status);
  ASSERT_EQ(result.asset.levels.size(), 3u);
  const std::vector<SectionKind> expected = {SectionKind::blocks, SectionKind::triangles,
                                             SectionKind::oriented_blocks, SectionKind::topology,
                                             SectionKind::components};
  for (std::uint32_t i = 0; i < 3; ++i) {
    std::size_t first = 0;
    EXPECT_EQ(kinds_in_order(file, i, first), expected);
    EXPECT_EQ(first, 1 + 5 * i);
    EXPECT_EQ(result.asset.level(i).error_bound, i);
    EXPECT_EQ(result.asset.level(i).triangle_count, i == 0 ? 30u : i == 1 ? 15u : 8u);
    EXPECT_EQ(test::defect_of_oriented_blocks(result.asset.level(i)), nullptr);
    EXPECT_EQ(test::defect_of_topology(result.asset.level(i)), nullptr);
  }
}

TEST(CheckLevels, LieWithinTheBoundsOfTheFinest) {
  for (int k = 0; k < 3; ++k) {
    for (const float way : {-1.0f, 1.0f}) {
      std::vector<test::Mesh> meshes = test::random_levels(30, 3, 2);
      float edge = meshes[0].points[0][k];
      for (const auto& point : meshes[0].points) edge = way * std::max(way * edge, way * point[k]);
      float& moved = meshes[2].points[meshes[2].triangles[7][1]][k];
      moved = edge;
      EXPECT_EQ(Bytes(test::make_file_of_levels(meshes)).check().status, Status::kOk) << k << " " << way;
      moved = std::nextafter(edge, 2 * way);
      const CheckResult beyond = Bytes(test::make_file_of_levels(meshes)).check();
      EXPECT_EQ(beyond.status, Status::kLevelOutsideBounds) << k << " " << way;
      EXPECT_EQ(beyond.where, 2u);
    }
  }
}

TEST(CheckLevels, NamesWhatIsAmiss) {
  const Bytes sound(test::make_file_of_levels(test::random_levels(30, 3, 3)));
  const auto status = [&](const std::function<void(Bytes&)>& damage) {
    Bytes file(sound);
    damage(file);
    return file.check_sealed();
  };
  const auto row = [](Bytes& f, int i) -> Level& { return (&f.level())[i]; };
  EXPECT_EQ(status([](Bytes&) {}), Status::kOk);
  EXPECT_EQ(status([&](Bytes& f) { row(f, 2).error_bound = 1; }), Status::kOk);
  EXPECT_EQ(status([&](Bytes& f) { row(f, 2).error_bound = 0.5; }), Status::kBadLevel);
  EXPECT_EQ(status([&](Bytes& f) { row(f, 1).error_bound = -1; }), Status::kBadLevel);
  EXPECT_EQ(status([&](Bytes& f) { row(f, 2).error_bound = std::numeric_limits<double>::infinity(); }),
            Status::kBadLevel);
  EXPECT_EQ(status([&](Bytes& f) { ++row(f, 1).triangle_count; }), Status::kBadLevel);
  EXPECT_EQ(status([&](Bytes& f) { std::swap(row(f, 1), row(f, 2)); }), Status::kBadLevel);
  EXPECT_EQ(status([](Bytes& f) { section_of(f, SectionKind::triangles, 1).level = 2; }),
            Status::kSectionDuplicated);
  EXPECT_EQ(status([](Bytes& f) { section_of(f, SectionKind::triangles, 2).level = 3; }),
            Status::kUnknownSection);
  EXPECT_EQ(status([](Bytes& f) {
              std::swap(section_of(f, SectionKind::components, 1).level,
                        section_of(f, SectionKind::topology, 2).level);
            }),
            Status::kSectionDuplicated);
}

TEST(CheckLevels, RejectsTruncatedAtEveryByte) {
  Bytes file(test::make_file_of_levels(test::random_levels(6, 2, 4)));
  for (std::size_t size = 0; size < file.size(); ++size)
    ASSERT_NE(Bytes(file.data(), size).check().status, Status::kOk) << size;
}

TEST(CheckLevels, EverySealedSingleByteChangeIsRejectedOrHarmless) {
  Bytes file(test::make_file_of_levels(test::random_levels(9, 2, 5)));
  for (std::size_t i = 16; i < file.size(); ++i) {
    for (const unsigned change : {0x01u, 0x80u}) {
      file.data()[i] ^= static_cast<unsigned char>(change);
      seal(file.data(), file.size());
      const CheckResult result = file.check();
      for (std::uint32_t level = 0; level < 2 && result.status == Status::kOk; ++level) {
        EXPECT_EQ(test::defect_of_oriented_blocks(result.asset.level(level)), nullptr) << i;
        EXPECT_EQ(test::defect_of_topology(result.asset.level(level)), nullptr) << i;
      }
      file.data()[i] ^= static_cast<unsigned char>(change);
    }
  }
}

}  // namespace
}  // namespace tandem
