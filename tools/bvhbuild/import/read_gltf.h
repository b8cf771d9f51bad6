#pragma once
#include <filesystem>
#include <string_view>

#include "read_limits.h"
#include "read_result.h"

namespace tandem::build {

/// Reads a glTF 2 file, text or binary. Buffers in files of their own are looked for in `folder`.
///
/// Result: see flatten_gltf(); the default scene, the first one when none is named, or all nodes when there
/// is no scene. Positions keep their float32, transforms their float64 value. Images are never looked at.
/// Memory and time are small multiples of what the file and its buffers hold, and of `limits.expansion`.
/// Errors: what is no glTF; buffers that are missing or too short, by name; what flatten_gltf() refuses;
/// extensions that hide the triangles from us, by name; what is beyond `limits`.
ReadResult read_gltf(std::string_view bytes, const std::filesystem::path& folder, const ReadLimits& limits);

}  // namespace tandem::build
