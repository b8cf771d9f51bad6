#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "import/gltf_json.h"

namespace tandem::build {

/// Reads a buffer that lies in a file of its own, its URI relative to `folder`. A file may be longer than its
/// buffer.
///
/// Effect: fills `bytes` with as many bytes as the buffer has.
/// Result: empty, or why not: "'wheel.bin': no such file".
std::string read_gltf_buffer_file(const std::filesystem::path& folder, const GltfBufferSource& source,
                                  std::vector<unsigned char>& bytes);

}  // namespace tandem::build
