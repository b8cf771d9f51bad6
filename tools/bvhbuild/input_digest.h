#pragma once
#include <cstdint>
#include <filesystem>

namespace tandem::build {

/// Size and XXH64 of a file's bytes: what `xxhsum -H64` prints. Both zero if the file cannot be read.
struct InputDigest {
  std::uint64_t bytes = 0;
  std::uint64_t hash = 0;
};

InputDigest digest_of(const std::filesystem::path& path);

}  // namespace tandem::build
