#pragma once
#include <filesystem>

#include "import.h"
#include "read_result.h"

namespace tandem::build {

/// Reads a mesh file with assimp in a child process under the limits of `options`, so that its crashes,
/// endless loops and appetite become errors: "assimp crashed (signal 11)". Must be called while the process
/// has a single thread.
ReadResult read_in_assimp_child(const std::filesystem::path& path, const ImportOptions& options);

}  // namespace tandem::build
