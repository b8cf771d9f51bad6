#pragma once
#include <filesystem>

#include "read_limits.h"
#include "read_result.h"

namespace tandem::build {

enum class Reader { automatic, tandem, assimp };

struct ImportOptions {
  Reader reader = Reader::automatic;
  double time_limit_seconds = 120;  ///< of the child process that runs assimp
  ReadLimits limits;
};

using ImportResult = ReadResult;

/// Reads the polygons of a mesh file.
///
/// Effect: opens `path` for reading, and the buffers that a glTF file names. Our own readers run in this
/// process; what they do not know goes to assimp, which runs in a child process under the limits of
/// `options`, so that its crashes, endless loops and appetite become errors. Leaves no file, process or
/// signal handler behind. Result: never throws; a file that holds no face at all is ok with no faces. Must be
/// called while the process has a single thread (it may fork).
ImportResult import_mesh(const std::filesystem::path& path, const ImportOptions& options);

}  // namespace tandem::build
