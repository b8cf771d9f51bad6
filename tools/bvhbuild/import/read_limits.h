#pragma once
#include <cstdint>

namespace tandem::build {

/// How much reading a file may take.
struct ReadLimits {
  /// The most address space that the child process which runs assimp may take; the largest file for our own
  /// readers, and the most that the buffers of a glTF file and its triangles may take.
  std::uint64_t memory_bytes = std::uint64_t{8} << 30;
  /// Vertices and faces that a scene may have beyond those that its file holds: instances repeat a mesh, and
  /// a count promises what no byte is there for. assimp may take 192 bytes for each of them and for each byte
  /// of the file. A tree over 4 million takes below 1 GiB and 10 s.
  std::uint64_t expansion = 4'000'000;
};

}  // namespace tandem::build
