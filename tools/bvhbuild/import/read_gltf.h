#pragma once
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "read_result.h"

namespace tandem::build {

/// Reads a glTF 2 file, text or binary. Buffers in files of their own are looked for in `folder`.
///
/// Result: see flatten_gltf(); the default scene, the first one when none is named, or all nodes when there
/// is no scene. Positions keep their float32, transforms their float64 value. Images are never looked at.
/// Memory is a small multiple of the bytes and of `most_bytes`, time that of both.
/// Errors: what is no glTF; buffers that are missing or too short, by name; what flatten_gltf() refuses;
/// extensions that hide the triangles from us, by name; what takes more than `most_bytes`.
ReadResult read_gltf(std::string_view bytes, const std::filesystem::path& folder, std::uint64_t most_bytes);

}  // namespace tandem::build
