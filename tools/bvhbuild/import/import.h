#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bvhbuild/meshing/meshing.h"

namespace tandem::build {

enum class Reader { automatic, tandem, assimp };

/// Says how much memory a file may take to read, how much larger than its file a scene may be, and which
/// other files it may name.
struct ReadLimits {
  /// The most address space that the child process which runs assimp may take; the largest file for our own
  /// readers, and the most that the buffers of a glTF file and its triangles may take.
  std::uint64_t memory_bytes = std::uint64_t{8} << 30;
  /// Vertices and faces that a scene may have beyond one for each byte of its files: instances repeat meshes,
  /// and counts promise elements without data. assimp may take 192 bytes of memory for each of them and for
  /// each byte of the file. A tree over 4 million faces takes below 1 GiB and 10 s.
  std::uint64_t expansion = 4'000'000;
  /// Says whether a file that a scene names may lie elsewhere than in the scene's folder or below it.
  bool outside_files = false;
};

struct ImportOptions {
  Reader reader = Reader::automatic;
  double time_limit_seconds = 120;  ///< of the child process that runs assimp
  ReadLimits limits;
};

/// The result of reading a mesh: the polygons, or the reason why there are none.
struct ReadResult {
  bool ok = false;
  PolygonMesh mesh;
  std::string error;  ///< when not ok: the reason without the file's name, "line 12: ...", "the reader
                      ///< crashed (signal 11)"
  std::vector<std::string> files{};  ///< when ok: the other files that were read, such as buffers of glTF
};

using ImportResult = ReadResult;

inline ReadResult read_failure(std::string reason) {
  return {false, {}, std::move(reason)};
}

/// Reads the polygons of a mesh file.
///
/// Effect: opens `path` for reading, and the files that it names, such as buffers of glTF: regular ones, in
/// its folder or below it unless `limits.outside_files` says otherwise. Our own readers run in this
/// process; what they do not know goes to assimp, which runs in a child process under the limits of
/// `options`, so that its crashes, endless loops and appetite become errors. Leaves no file, process or
/// signal handler behind. Result: never throws; a file that holds no face at all is ok with no faces. Must be
/// called while the process has a single thread (it may fork).
ReadResult import_mesh(const std::filesystem::path& path, const ImportOptions& options);

}  // namespace tandem::build
