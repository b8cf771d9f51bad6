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

/// A buffer of a glTF file.
struct GltfBuffer {
  std::vector<char> decoded;              ///< the bytes of a data URI; empty for other buffers
  std::shared_ptr<const InputFile> file;  ///< the file that the bytes lie in; null for other buffers
  std::string_view bytes;                 ///< of `decoded`, of `file`, or of the container
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
  std::uint64_t most_bytes_in_files{};  ///< that may still be read; each file that is read lowers it
  /// The files that buffers were found in. Each is read once, whatever names the buffers call it by.
  std::map<InputFile::Identity, std::shared_ptr<const InputFile>> files;
};

/// Finds the bytes of a buffer: in a data URI, a file or the chunk, which all may be longer than the buffer.
///
/// Result: as many bytes as the source says. Throws a GltfError: "buffers[0]: 'wheel.bin': no such file".
GltfBuffer read_gltf_buffer(const GltfBufferSource& source, GltfBufferPlaces& places);

/// Replaces escapes: "a%20b.bin" becomes "a b.bin". Everything else stays as it is.
std::string percent_decoded(std::string_view text);

/// Decodes base64 up to the first character that is no digit of it, and at most `most_bytes` bytes.
std::vector<char> base64_decoded(std::string_view text, std::uint64_t most_bytes);

}  // namespace tandem::build
