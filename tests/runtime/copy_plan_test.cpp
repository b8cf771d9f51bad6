// Tests where bytes of many files lie in one copy of them, in which chunks they are copied, and by how many
// threads.
#include "copy_plan.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace tandem {
namespace {

/// Files of these sizes, no two bytes of neighbours alike.
class Files {
 public:
  explicit Files(const std::vector<std::uint64_t>& sizes)
      : bytes_(std::accumulate(sizes.begin(), sizes.end(), std::uint64_t{0})) {
    for (std::size_t i = 0; i < bytes_.size(); ++i) bytes_[i] = static_cast<unsigned char>(1 + i % 251);
    const unsigned char* from = bytes_.data();
    for (const std::uint64_t bytes : sizes) {
      pieces.push_back({from, bytes, 0});
      from += bytes;
    }
    size = place(pieces);
  }

  std::vector<Piece> pieces;
  std::uint64_t size;

  /// All files at their places, 0 between them.
  std::vector<unsigned char> copy() const {
    std::vector<unsigned char> whole(size, 0);
    for (const Piece& piece : pieces) std::copy_n(piece.from, piece.bytes, whole.begin() + piece.offset);
    return whole;
  }

 private:
  std::vector<unsigned char> bytes_;
};

TEST(CopyPlan, PiecesLieOneBehindTheOtherAligned) {
  const Files files({1, 255, 256, 257, 0, 1000, 512});
  std::uint64_t end = 0;
  for (const Piece& piece : files.pieces) {
    EXPECT_EQ(piece.offset % kSectionAlignment, 0u);
    EXPECT_GE(piece.offset, end);
    EXPECT_LT(piece.offset - end, kSectionAlignment);
    end = piece.offset + piece.bytes;
  }
  EXPECT_EQ(files.size, end);
  EXPECT_EQ(Files({}).size, 0u);
}

TEST(CopyPlan, ChunksOfAnySizeMakeTheWholeCopy) {
  for (const std::vector<std::uint64_t>& sizes : {std::vector<std::uint64_t>{},
                                                  {0},
                                                  {1},
                                                  {4096},
                                                  {1, 1, 1, 1, 1, 1},
                                                  {4096, 4096},
                                                  {300, 0, 0, 5000},
                                                  {100, 20'000, 256, 255, 257, 3, 4097, 12'288}}) {
    const Files files(sizes);
    for (const std::uint64_t chunk : {1, 100, 256, 4096, 5000, 1 << 20}) {
      std::vector<unsigned char> copied(files.size, 0);
      for (std::uint64_t begin = 0; begin < files.size; begin += chunk) {
        const std::uint64_t end = std::min(begin + chunk, files.size);
        for_each_part(files.pieces, begin, end,
                      [&](const unsigned char* from, std::uint64_t bytes, std::uint64_t offset) {
                        ASSERT_GE(offset, begin);
                        ASSERT_LE(offset + bytes, end);
                        for (std::uint64_t i = 0; i < bytes; ++i) {
                          ASSERT_EQ(copied[offset + i], 0);  // once
                          copied[offset + i] = from[i];
                        }
                      });
      }
      EXPECT_EQ(copied, files.copy()) << sizes.size() << " files, chunks of " << chunk;
    }
  }
}

TEST(CopyPlan, ThreadsComeWithBytesAndCores) {
  constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
  EXPECT_EQ(staging_of(0, 16).threads, 0u);
  EXPECT_EQ(staging_of(128 * kMiB - 1, 16).threads, 0u);
  EXPECT_EQ(staging_of(128 * kMiB, 16).threads, 2u);
  EXPECT_EQ(staging_of(400 * kMiB, 16).threads, 6u);
  EXPECT_EQ(staging_of(400 * kMiB, 4).threads, 4u);
  EXPECT_EQ(staging_of(10'000 * kMiB, 1).threads, 0u);
  EXPECT_EQ(staging_of(10'000 * kMiB, 0).threads, 0u);
  EXPECT_EQ(staging_of(10'000 * kMiB, 64).threads, kMostStagingThreads);
}

}  // namespace
}  // namespace tandem
