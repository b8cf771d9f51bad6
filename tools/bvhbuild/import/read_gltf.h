#pragma once
#include <cstdint>
#include <filesystem>

#include "import/read_result.h"

namespace tandem::build {

/// Reads a glTF 2 file, text or binary, with tinygltf, in this process. tinygltf may crash on hostile files
/// or take much memory, so this belongs into a child process (see gltf_child.h).
///
/// Result: see flatten_gltf(); the default scene, the first one when none is named, or all nodes when there
/// is no scene. Positions keep their float32, transforms their float64 value. Images are never opened.
/// Errors: what is no glTF; buffers that are missing or too short, by name; what flatten_gltf() refuses;
/// extensions that hide the triangles from us, by name.
ReadResult read_gltf(const std::filesystem::path& path, std::uint64_t most_bytes);

}  // namespace tandem::build
