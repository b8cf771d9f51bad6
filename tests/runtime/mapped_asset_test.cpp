// Views of runs of levels, and what of a file is copied to a GPU for them.
#include <gtest/gtest.h>
#if !defined(_WIN32)
#include <sys/stat.h>
#endif

#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "build/sample_asset.h"
#include "copy_plan.h"
#include "gpu/made_files.h"
#include "tandem/runtime/map.h"
#include "temp_folder.h"

namespace tandem::test {
namespace {

constexpr std::uint32_t kTriangles[] = {2001, 300, 20, 7};
constexpr double kErrors[] = {0, 0.001, 0.01, 0.1};
constexpr std::uint32_t kLevels = 4;

/// Four levels; the coarser ones are the first triangles of the finest.
Bytes four_levels() {
  const Mesh finest = random_mesh(kTriangles[0], 5);
  std::vector<MadeLevel> levels;
  for (std::uint32_t i = 0; i < kLevels; ++i) {
    Mesh mesh = finest;
    mesh.triangles.resize(kTriangles[i]);
    mesh.points.resize(3 * kTriangles[i]);
    levels.push_back(built_level(mesh, kErrors[i]));
  }
  return made_file(levels);
}

void expect_same(const LevelView& view, const LevelView& expected) {
  EXPECT_EQ(view.blocks, expected.blocks);
  EXPECT_EQ(view.triangles, expected.triangles);
  EXPECT_EQ(view.oriented_blocks, expected.oriented_blocks);
  EXPECT_EQ(view.topology, expected.topology);
  EXPECT_EQ(view.components, expected.components);
  EXPECT_EQ(view.triangle_count, expected.triangle_count);
  EXPECT_EQ(view.number, expected.number);
  EXPECT_EQ(view.error_bound, expected.error_bound);
}

TEST(LevelViews, ShowARunOfLevelsFromAnyOnThatOthersTakeAsLevel0) {
  const Bytes file = four_levels();
  const AssetView all = file.check().asset;
  for (std::uint32_t first = 0; first < kLevels; ++first) {
    for (std::uint32_t count = 1; count <= kLevels + 1; ++count) {
      const AssetView view = all.levels_from(first, count);
      ASSERT_EQ(view.levels.size(), std::min(count, kLevels - first));
      for (std::uint32_t i = 0; i < view.levels.size(); ++i) {
        expect_same(view.level(i), all.level(first + i));
        expect_same(view.levels_from(i).level(), all.level(first + i));
        EXPECT_EQ(view.level(i).number, first + i);
        EXPECT_EQ(view.level(i).triangle_count, kTriangles[first + i]);
      }
    }
    EXPECT_EQ(all.levels_from(first).levels.size(), kLevels - first);
  }
}

TEST(LevelViews, AreThoseOfTheCheckWhereTheFileWasCheckedBefore) {
  const Bytes file = four_levels();
  const AssetView checked = file.check().asset;
  const AssetView view = view_of_checked(checked.header);
  EXPECT_EQ(view.header, checked.header);
  EXPECT_EQ(view.sections.data(), checked.sections.data());
  EXPECT_EQ(view.sections.size(), checked.sections.size());
  EXPECT_EQ(view.first_level, 0u);
  EXPECT_EQ(view.parts.data(), checked.parts.data());
  EXPECT_EQ(view.parts.size(), checked.parts.size());
  EXPECT_EQ(view.strings, checked.strings);
  EXPECT_EQ(view.provenance, checked.provenance);
  ASSERT_EQ(view.levels.size(), kLevels);
  for (std::uint32_t i = 0; i < kLevels; ++i) expect_same(view.level(i), checked.level(i));
}

TEST(LevelViews, NameTheCoarsestLevelWithinATolerance) {
  const Bytes file = four_levels();
  const AssetView all = file.check().asset;
  for (const auto& [tolerance, level] : {std::pair{0.0, 0u},
                                         {std::nextafter(0.001, 0), 0u},
                                         {0.001, 1u},
                                         {0.05, 2u},
                                         {0.1, 3u},
                                         {1e300, 3u},
                                         {-1.0, 0u},
                                         {std::nan(""), 0u}})
    EXPECT_EQ(all.coarsest_level(tolerance), level) << tolerance;
  EXPECT_EQ(all.levels_from(1).coarsest_level(0.05), 1u);
  EXPECT_EQ(all.levels_from(1).coarsest_level(0), 0u);
  EXPECT_EQ(all.levels_from(0, 2).coarsest_level(1), 1u);
}

std::vector<Piece> pieces_of(const AssetView& view, Contents contents) {
  std::vector<Piece> pieces;
  for_each_piece(view, contents, [&](const Piece& piece) { pieces.push_back(piece); });
  return pieces;
}

std::uint64_t wanted_bytes(const AssetView& view, Contents contents) {
  std::uint64_t bytes = 0;
  for (std::uint32_t i = 0; i < view.levels.size(); ++i) {
    const LevelView level = view.level(i);
    bytes += level.triangle_count * sizeof(Triangle) + level.block_count * sizeof(OrientedBlock);
    if (contents == Contents::all) bytes += level.block_count * sizeof(Block);
    if (contents == Contents::exact_queries) continue;
    bytes +=
        level.triangle_count * sizeof(TriangleTopology) + level.component_count * sizeof(SurfaceComponent);
    bytes += level.vertex_count * sizeof(std::uint32_t);
  }
  return bytes;
}

bool is_in(const std::vector<Piece>& pieces, const void* element) {
  const auto* at = static_cast<const unsigned char*>(element);
  return std::any_of(pieces.begin(), pieces.end(),
                     [&](const Piece& piece) { return at >= piece.from && at < piece.from + piece.bytes; });
}

TEST(LevelViews, AreCopiedWithoutTheOtherLevels) {
  const Bytes file = four_levels();
  const AssetView all = file.check().asset;
  for (const Contents contents : {Contents::all, Contents::exact_queries, Contents::manifolds}) {
    for (std::uint32_t first = 0; first < kLevels; ++first) {
      for (std::uint32_t count = 1; count <= kLevels - first; ++count) {
        const AssetView view = all.levels_from(first, count);
        if (contents == Contents::all && count == kLevels) continue;
        const std::vector<Piece> pieces = pieces_of(view, contents);
        std::uint64_t bytes = 0;
        for (const Piece& piece : pieces) {
          bytes += piece.bytes;
          EXPECT_EQ((piece.from - reinterpret_cast<const unsigned char*>(all.header)) % kSectionAlignment, 0);
        }
        EXPECT_GE(bytes, wanted_bytes(view, contents));
        EXPECT_LT(bytes, wanted_bytes(view, contents) + 7 * count * kSectionAlignment);
        for (std::uint32_t i = 0; i < kLevels; ++i) {
          const bool shown = i >= first && i < first + count;
          const LevelView level = all.level(i);
          EXPECT_EQ(is_in(pieces, level.triangles), shown);
          EXPECT_EQ(is_in(pieces, level.triangles + level.triangle_count - 1), shown);
          EXPECT_EQ(is_in(pieces, level.oriented_blocks), shown);
          EXPECT_EQ(is_in(pieces, level.blocks), shown && contents == Contents::all);
          for (const void* elements :
               {static_cast<const void*>(level.topology), static_cast<const void*>(level.source_vertices)})
            EXPECT_EQ(is_in(pieces, elements), shown && contents != Contents::exact_queries);
        }
      }
    }
  }
}

TEST(LevelViews, OfAWholeFileAreCopiedAsItIs) {
  const Bytes file = four_levels();
  const AssetView all = file.check().asset;
  const std::vector<Piece> pieces = pieces_of(all, Contents::all);
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].bytes, all.header->file_bytes);
  EXPECT_TRUE(is_in(pieces, all.header));
}

#ifdef __linux__
/// Bytes of the mapping at an address that lie in the process's memory.
std::uint64_t resident_bytes(const void* mapping) {
  std::ifstream maps("/proc/self/smaps");
  std::ostringstream begin;
  begin << std::hex << reinterpret_cast<std::uintptr_t>(mapping) << '-';
  for (std::string line; std::getline(maps, line);) {
    if (!line.starts_with(begin.str())) continue;
    while (std::getline(maps, line) && !line.starts_with("Rss:")) {
    }
    return 1024 * std::stoull(line.substr(4));
  }
  return ~std::uint64_t{0};
}

TEST(LevelViews, TakeMemoryOfTheProcessForTheLevelsThatAreUsed) {
  std::vector<MadeLevel> levels;
  for (const std::uint32_t triangles : {120'000u, 100u}) {
    Mesh mesh = random_mesh(120'000, 5);
    mesh.triangles.resize(triangles);
    levels.push_back({mesh,
                      build::build_tree(mesh.geometry(), build::Imaginary::minimal, build::Effort::fast),
                      levels.empty() ? 0.0 : 0.5});
  }
  const Bytes bytes = made_file(levels);
  const TempFolder folder;
  const std::string path =
      folder.write("a.bvh", {reinterpret_cast<const char*>(bytes.check().asset.header), bytes.size()})
          .string();
  MappedAsset asset;
  ASSERT_EQ(asset.open(path.c_str()), Status::kOk);
  ASSERT_TRUE(asset.is_mapped());
  const auto touch = [](const LevelView& level) {
    float sum = 0;
    for (std::uint32_t t = 0; t < level.triangle_count; ++t) sum += level.triangles[t].corner[0].position[0];
    return sum;
  };
  EXPECT_GT(touch(asset.view().level(1)), 0);
  // A page brings its neighbours along, up to 2 MiB of them where the file system keeps them together.
  EXPECT_LT(resident_bytes(asset.data()), bytes.size() / 2);
  const std::uint64_t before = resident_bytes(asset.data());
  EXPECT_GT(touch(asset.view().level(0)), 0);
  EXPECT_GT(resident_bytes(asset.data()), before);
}
#endif

namespace fs = std::filesystem;

class Map : public testing::TestWithParam<Access> {
 protected:
  std::string write(const char* file, const void* data, std::size_t size) const {
    return temporary_.write(file, {static_cast<const char*>(data), size}).string();
  }
  std::string write_asset(const char* file, std::uint32_t triangles) const {
    const build::Image image = make_file(random_mesh(triangles, 1));
    return write(file, image.data(), image.size());
  }

  TempFolder temporary_;
  fs::path folder_ = temporary_.path();
};

INSTANTIATE_TEST_SUITE_P(Access, Map, testing::Values(Access::map, Access::read));

TEST_P(Map, HandsOutACheckedView) {
  MappedAsset asset;
  ASSERT_EQ(asset.open(write_asset("a b.bvh", 100).c_str(), GetParam()), Status::kOk);
  EXPECT_EQ(asset.view().level().triangle_count, 100u);
  EXPECT_EQ(asset.is_mapped(), GetParam() == Access::map);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(asset.view().level().blocks) % 128, 0u);
}

TEST_P(Map, NamesWhatCannotBeOpened) {
  MappedAsset asset;
  EXPECT_EQ(asset.open((folder_ / "missing").string().c_str(), GetParam()), Status::kFileNotFound);
  EXPECT_EQ(asset.open(folder_.string().c_str(), GetParam()), Status::kNotARegularFile);
  EXPECT_EQ(asset.open(write("empty", "", 0).c_str(), GetParam()), Status::kNotTandem);
  EXPECT_EQ(asset.open(write("walk.bvh", "HIERARCHY\nROOT", 14).c_str(), GetParam()),
            Status::kBiovisionMotionCapture);
  EXPECT_EQ(asset.data(), nullptr);
}

TEST_P(Map, ADefectClosesTheFileAndSaysWhere) {
  build::Image image = make_file(random_mesh(100, 1));
  const auto blocks = check(image.data(), image.size()).asset.level().blocks;
  const_cast<Block*>(blocks)[3].centre[0][0] = 1e30f;
  seal(image.data(), image.size());
  MappedAsset asset;
  EXPECT_EQ(asset.open(write("bad.bvh", image.data(), image.size()).c_str(), GetParam()),
            Status::kChildOutsideParentBox);
  EXPECT_LT(asset.where(), 3u);
  EXPECT_EQ(asset.data(), nullptr);
}

TEST_P(Map, MovesAndReopens) {
  MappedAsset first;
  ASSERT_EQ(first.open(write_asset("a.bvh", 10).c_str(), GetParam()), Status::kOk);
  MappedAsset second = std::move(first);
  EXPECT_EQ(second.view().level().triangle_count, 10u);
  ASSERT_EQ(second.open(write_asset("b.bvh", 20).c_str(), GetParam()), Status::kOk);
  EXPECT_EQ(second.view().level().triangle_count, 20u);
  second.close();
  EXPECT_EQ(second.data(), nullptr);
}

// A mapped file stays whole where a system refuses to replace it.
TEST_P(Map, KeepsWhatItHoldsWhileTheFileIsReplaced) {
  const std::string path = write_asset("a.bvh", 10);
  MappedAsset asset, other;
  ASSERT_EQ(asset.open(path.c_str(), GetParam()), Status::kOk);
  std::error_code refused;
  fs::rename(write_asset("b.bvh", 20), path, refused);
  EXPECT_EQ(check(asset.data(), asset.view().header->file_bytes).status, Status::kOk);
  EXPECT_EQ(asset.view().level().triangle_count, 10u);
  ASSERT_EQ(other.open(path.c_str(), GetParam()), Status::kOk);
  EXPECT_EQ(other.view().level().triangle_count, refused ? 10u : 20u);
}

TEST_P(Map, TakesNamesOfAnyLettersAsUtf8) {
  const fs::path path = folder_ / u8"K\u00fche \u725b \U0001F404.bvh";
  fs::rename(write_asset("a.bvh", 10), path);
  const std::u8string name = path.u8string();
  MappedAsset asset;
  EXPECT_EQ(asset.open(reinterpret_cast<const char*>(name.c_str()), GetParam()), Status::kOk);
}

#if !defined(_WIN32)
TEST_P(Map, RefusesAPipeWithoutWaiting) {
  const std::string path = (folder_ / "pipe").string();
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  MappedAsset asset;
  EXPECT_EQ(asset.open(path.c_str(), GetParam()), Status::kNotARegularFile);
}
#endif

}  // namespace
}  // namespace tandem::test
