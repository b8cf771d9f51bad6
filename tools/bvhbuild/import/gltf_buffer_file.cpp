#include "import/gltf_buffer_file.h"

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "import/input_file.h"
#include "import/printable.h"

namespace tandem::build {
namespace {

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// "a%20b.bin" is the file "a b.bin". (tinygltf's own decoder turns "a+b.bin" into it too.)
std::string percent_decoded(std::string_view uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool is_escape =
        uri[i] == '%' && i + 2 < uri.size() && hex_digit(uri[i + 1]) >= 0 && hex_digit(uri[i + 2]) >= 0;
    text += is_escape ? static_cast<char>(hex_digit(uri[i + 1]) * 16 + hex_digit(uri[i + 2])) : uri[i];
    if (is_escape) i += 2;
  }
  return text;
}

bool has_scheme(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  return colon != std::string_view::npos && uri.substr(0, colon).find('/') == std::string_view::npos &&
         colon > 1;
}

}  // namespace

std::string read_gltf_buffer_file(const std::filesystem::path& folder, const GltfBufferSource& source,
                                  std::vector<unsigned char>& bytes) {
  if (source.uri.starts_with("data:"))
    return build::quoted(source.uri) + " is not the kind of data that a buffer has";
  if (has_scheme(source.uri)) return build::quoted(source.uri) + " is not a file beside the glTF";
  const std::string name = percent_decoded(source.uri);
  InputFile file;
  std::string wrong = name.find('\0') == std::string::npos ? file.open(folder / name) : "no such file";
  if (wrong.empty() && file.size() < source.bytes)
    wrong =
        "holds " + std::to_string(file.size()) + " bytes, " + std::to_string(source.bytes) + " are needed";
  if (wrong.empty()) wrong = file.read_all();
  if (!wrong.empty()) return build::quoted(name) + ": " + wrong;
  // A file may be longer than its buffer, which tinygltf does not know.
  const std::size_t count = std::min<std::size_t>(source.bytes, file.bytes().size());
  bytes.assign(file.bytes().begin(), file.bytes().begin() + static_cast<std::ptrdiff_t>(count));
  return {};
}

}  // namespace tandem::build
