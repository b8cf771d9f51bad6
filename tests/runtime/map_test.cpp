#include "tandem/runtime/map.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "build/sample_asset.h"
#include "temp_folder.h"

namespace tandem {
namespace {

namespace fs = std::filesystem;

class Map : public testing::TestWithParam<Access> {
 protected:
  std::string write(const char* file, const void* data, std::size_t size) const {
    return temporary_.write(file, {static_cast<const char*>(data), size}).string();
  }
  std::string write_asset(const char* file, std::uint32_t triangles) const {
    const build::Image image = test::make_file(test::random_mesh(triangles, 1));
    return write(file, image.data(), image.size());
  }

  test::TempFolder temporary_;
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
  EXPECT_EQ(asset.open((folder_ / "missing").c_str(), GetParam()), Status::kFileNotFound);
  EXPECT_EQ(asset.open(folder_.c_str(), GetParam()), Status::kNotARegularFile);
  EXPECT_EQ(asset.open(write("empty", "", 0).c_str(), GetParam()), Status::kNotTandem);
  EXPECT_EQ(asset.open(write("walk.bvh", "HIERARCHY\nROOT", 14).c_str(), GetParam()),
            Status::kBiovisionMotionCapture);
  EXPECT_EQ(asset.data(), nullptr);
}

TEST_P(Map, ADefectClosesTheFileAndSaysWhere) {
  build::Image image = test::make_file(test::random_mesh(100, 1));
  const auto blocks = check(image.data(), image.size()).asset.level().blocks;
  const_cast<Block*>(blocks)[3].center[0][0] = 1e30f;
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

TEST(MapPipe, IsRefusedWithoutWaiting) {
  const std::string path =
      (fs::temp_directory_path() / ("tandem pipe " + std::to_string(::getpid()))).string();
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  MappedAsset asset;
  EXPECT_EQ(asset.open(path.c_str()), Status::kNotARegularFile);
  EXPECT_EQ(asset.open(path.c_str(), Access::read), Status::kNotARegularFile);
  fs::remove(path);
}

}  // namespace
}  // namespace tandem
