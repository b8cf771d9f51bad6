#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "input_file.h"

namespace tandem::build {

/// A buffer of a glTF file. Its bytes lie in a data URI that was decoded, in a file, or in the container.
struct GltfBuffer {
  std::vector<char> decoded;
  std::shared_ptr<const InputFile> file;
  std::string_view bytes;
};

/// A buffer as the JSON announces it.
struct GltfBufferSource {
  std::string name;  ///< for messages: "buffers[0] 'wheel'"
  std::string uri;   ///< empty: the binary chunk of a GLB file
  std::uint64_t bytes = 0;
};

/// Where the bytes of buffers may lie.
struct GltfBufferPlaces {
  std::filesystem::path folder;         ///< that file names are relative to
  bool is_binary = false;               ///< whether this is a GLB file
  std::string_view chunk;               ///< its binary chunk
  std::uint64_t most_bytes_in_files{};  ///< that may still be read; grows less
  /// Files that buffers were found in. Each is read once, by whatever names buffers call it.
  std::map<InputFile::Identity, std::shared_ptr<const InputFile>> files;
};

/// Finds the bytes of a buffer: in a data URI, a file or the chunk, which all may be longer than the buffer.
///
/// Result: as many bytes as the source says. Throws a GltfError: "buffers[0]: 'wheel.bin': no such file".
GltfBuffer read_gltf_buffer(const GltfBufferSource& source, GltfBufferPlaces& places);

/// "a%20b.bin" is "a b.bin". What is no escape stays.
std::string percent_decoded(std::string_view text);

/// The bytes that a base64 text stands for, up to the first sign that is none, at most `most_bytes`.
std::vector<char> base64_decoded(std::string_view text, std::uint64_t most_bytes);

}  // namespace tandem::build
