#include "gltf_buffer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "common/printable.h"
#include "gltf_model.h"

namespace tandem::build {
namespace {

constexpr std::string_view kBase64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The value of each sign, -1 of those that are no digits.
constexpr std::array<signed char, 256> base64_values() {
  std::array<signed char, 256> values{};
  values.fill(-1);
  for (std::size_t i = 0; i < kBase64.size(); ++i)
    values[static_cast<unsigned char>(kBase64[i])] = static_cast<signed char>(i);
  return values;
}

bool has_scheme(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  return colon != std::string_view::npos && uri.substr(0, colon).find('/') == std::string_view::npos &&
         colon > 1;
}

void check_length(const GltfBufferSource& source, const char* holder, std::uint64_t held) {
  if (held < source.bytes)
    throw GltfError(source.name + ": " + holder + " holds " + std::to_string(held) +
                    " bytes, its byteLength says " + std::to_string(source.bytes));
}

std::vector<char> bytes_of_data_uri(const GltfBufferSource& source) {
  const std::string_view uri = source.uri;
  const std::size_t comma = std::min(uri.find(','), uri.size());
  if (!uri.substr(0, comma).ends_with(";base64"))
    throw GltfError(source.name + ": " + in_quotes(uri) + " is not the kind of data that a buffer has");
  const std::string_view text = uri.substr(std::min(comma + 1, uri.size()));
  const bool is_escaped = text.find('%') != std::string_view::npos;
  std::vector<char> bytes = base64_decoded(is_escaped ? percent_decoded(text) : text, source.bytes);
  check_length(source, "its data URI", bytes.size());
  return bytes;
}

/// Effect: `file` becomes the file of this name, read whole. Result: empty, or why it cannot be read.
std::string read_file(const std::string& name, GltfBufferPlaces& places,
                      std::shared_ptr<const InputFile>& file) {
  const auto opened = std::make_shared<InputFile>();
  if (name.find('\0') != std::string::npos) return "no such file";
  const std::string wrong = opened->open(places.folder / name);
  if (!wrong.empty()) return wrong;
  const auto known = places.files.find(opened->identity());
  if (known != places.files.end()) return file = known->second, std::string();
  if (opened->size() > places.most_bytes_in_files)
    return "its bytes take more than the memory limit (--memory-limit)";
  places.most_bytes_in_files -= opened->size();
  places.files.emplace(opened->identity(), file = opened);
  return opened->read_all();
}

std::shared_ptr<const InputFile> file_of(const GltfBufferSource& source, GltfBufferPlaces& places) {
  if (has_scheme(source.uri))
    throw GltfError(source.name + ": " + in_quotes(source.uri) + " is not a file beside the glTF");
  const std::string name = percent_decoded(source.uri);
  std::shared_ptr<const InputFile> file;
  std::string wrong = read_file(name, places, file);
  if (wrong.empty() && file->bytes().size() < source.bytes)
    wrong = "holds " + std::to_string(file->bytes().size()) + " bytes, " + std::to_string(source.bytes) +
            " are needed";
  if (!wrong.empty()) throw GltfError(source.name + ": " + in_quotes(name) + ": " + wrong);
  return file;
}

}  // namespace

GltfBuffer read_gltf_buffer(const GltfBufferSource& source, GltfBufferPlaces& places) {
  GltfBuffer buffer;
  if (source.bytes == 0) throw GltfError(source.name + " has no byteLength");
  if (source.uri.starts_with("data:")) {
    buffer.decoded = bytes_of_data_uri(source);
    buffer.bytes = {buffer.decoded.data(), buffer.decoded.size()};
  } else if (!source.uri.empty()) {
    buffer.file = file_of(source, places);
    buffer.bytes = buffer.file->bytes().substr(0, source.bytes);
  } else {
    if (!places.is_binary) throw GltfError(source.name + " has no uri, so its bytes are nowhere");
    check_length(source, "the binary chunk", places.chunk.size());
    buffer.bytes = places.chunk.substr(0, source.bytes);
  }
  return buffer;
}

std::string percent_decoded(std::string_view text) {
  constexpr std::size_t kEscape = 3;  // "%20"
  std::string decoded;
  while (!text.empty()) {
    const std::string_view escape = text.substr(0, kEscape);
    std::uint8_t byte = 0;
    const bool is_escape =
        escape.size() == kEscape && escape[0] == '%' &&
        std::from_chars(escape.data() + 1, escape.data() + kEscape, byte, 16).ptr == escape.data() + kEscape;
    decoded += is_escape ? static_cast<char>(byte) : text[0];
    text.remove_prefix(is_escape ? kEscape : 1);
  }
  return decoded;
}

std::vector<char> base64_decoded(std::string_view text, std::uint64_t most_bytes) {
  static constexpr std::array<signed char, 256> kValues = base64_values();
  std::vector<char> bytes;
  bytes.reserve(std::min<std::uint64_t>(text.size() / 4 * 3 + 2, most_bytes));
  std::uint32_t bits = 0;  // the low `count` ones are not yet written
  int count = 0;
  for (const char sign : text) {
    const int value = kValues[static_cast<unsigned char>(sign)];
    if (value < 0 || bytes.size() == most_bytes) break;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<char>(bits >> count & 0xFFu));
  }
  return bytes;
}

}  // namespace tandem::build
