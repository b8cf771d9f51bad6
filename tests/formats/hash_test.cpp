#include "tandem/formats/hash.h"

#include <gtest/gtest.h>
#include <xxhash.h>

#include <random>
#include <vector>

namespace tandem {
namespace {

TEST(Hash, EqualsTheReferenceLibraryForEveryLengthAndSeed) {
  std::mt19937_64 random(1);
  std::vector<unsigned char> bytes(600);
  for (auto& byte : bytes) byte = static_cast<unsigned char>(random());
  for (std::size_t length = 0; length <= bytes.size(); ++length) {
    const std::uint64_t seed = length % 3 == 0 ? 0 : random();
    EXPECT_EQ(xxh64(bytes.data(), length, seed), XXH64(bytes.data(), length, seed)) << length;
  }
}

TEST(Hash, ReadsUnalignedBytes) {
  std::vector<unsigned char> bytes(100, 7);
  for (std::size_t offset = 0; offset < 16; ++offset) {
    EXPECT_EQ(xxh64(bytes.data() + offset, 64), XXH64(bytes.data() + offset, 64, 0));
  }
}

}  // namespace
}  // namespace tandem
