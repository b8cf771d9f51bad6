#pragma once
#include <filesystem>

#include "import/import.h"
#include "import/read_result.h"

namespace tandem::build {

/// Reads a glTF file with read_gltf() in a child process under the limits of `options`, so that crashes and
/// appetite become errors: "tinygltf crashed (signal 11)". Must be called while the process has a single
/// thread.
ReadResult read_in_gltf_child(const std::filesystem::path& path, const ImportOptions& options);

}  // namespace tandem::build
