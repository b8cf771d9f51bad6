#include "gltf_container.h"

#include <bit>
#include <cstdint>

#include "binary_number.h"
#include "gltf_model.h"

namespace tandem::build {
namespace {

constexpr std::uint64_t kHeaderBytes = 12;  // magic, version, length of the file
constexpr std::uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;

std::uint32_t word(std::string_view bytes, std::uint64_t offset) {
  return load_number<std::uint32_t, std::endian::little>(bytes.data() + offset);
}

struct Chunk {
  std::uint32_t type;
  std::string_view bytes;
};

/// Takes a chunk off the front of what is left of a file.
Chunk take_chunk(std::string_view& left, const char* name) {
  constexpr std::uint64_t kHead = 8;  // length of the chunk, type
  if (left.size() < kHead || word(left, 0) > left.size() - kHead)
    throw GltfError("its " + std::string(name) + " chunk is cut short");
  const Chunk chunk{word(left, 4), left.substr(kHead, word(left, 0))};
  left.remove_prefix(kHead + chunk.bytes.size());
  return chunk;
}

}  // namespace

GltfContainer open_gltf_container(std::string_view bytes) {
  if (!bytes.starts_with("glTF")) return {false, bytes, {}};
  if (bytes.size() < kHeaderBytes) throw GltfError("its GLB header is cut short");
  check_gltf_version(std::to_string(word(bytes, 4)) + ".0");
  const std::uint64_t promised = word(bytes, 8);
  if (promised > bytes.size())
    throw GltfError("its GLB header promises " + std::to_string(promised) + " bytes, the file holds " +
                    std::to_string(bytes.size()));
  std::string_view left = bytes.substr(0, promised);
  left.remove_prefix(std::min<std::uint64_t>(kHeaderBytes, promised));
  const Chunk json = take_chunk(left, "JSON");
  if (json.type != kJson) throw GltfError("its first chunk is not JSON");
  GltfContainer container{true, json.bytes, {}};
  while (!left.empty() && container.chunk.empty()) {
    const Chunk chunk = take_chunk(left, "binary");
    if (chunk.type == kBinary) container.chunk = chunk.bytes;
  }
  return container;
}

}  // namespace tandem::build
