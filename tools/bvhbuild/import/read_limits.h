#pragma once
#include <cstdint>

namespace tandem::build {

/// How much memory a file may take to read, and how much larger than its file a scene may be.
struct ReadLimits {
  /// The most address space that the child process which runs assimp may take; the largest file for our own
  /// readers, and the most that the buffers of a glTF file and its triangles may take.
  std::uint64_t memory_bytes = std::uint64_t{8} << 30;
  /// Vertices and faces that a scene may have beyond one for each byte of its files: instances repeat meshes,
  /// and counts promise elements without data. assimp may take 192 bytes of memory for each of them and for
  /// each byte of the file. A tree over 4 million faces takes below 1 GiB and 10 s.
  std::uint64_t expansion = 4'000'000;
};

}  // namespace tandem::build
