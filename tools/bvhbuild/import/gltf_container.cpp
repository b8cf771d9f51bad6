#include "import/gltf_container.h"

#include <bit>
#include <cstdint>

#include "import/binary_number.h"

namespace tandem::build {
namespace {

constexpr std::uint64_t kHeaderBytes = 12;  // magic, version, length of the file
constexpr std::uint64_t kChunkBytes = 8;    // length of the chunk, type

std::uint64_t word(std::string_view bytes, std::uint64_t offset) {
  return load_number<std::uint32_t, std::endian::little>(bytes.data() + offset);
}

GltfContainer failure(std::string error) {
  GltfContainer container;
  container.error = std::move(error);
  return container;
}

/// Whether a chunk that begins at `offset` lies before `end`.
bool holds_chunk(std::string_view bytes, std::uint64_t offset, std::uint64_t end) {
  return offset + kChunkBytes <= end && word(bytes, offset) <= end - offset - kChunkBytes;
}

GltfContainer open_binary(std::string_view bytes) {
  constexpr std::uint64_t kJson = 0x4E4F534A;
  if (bytes.size() < kHeaderBytes) return failure("its GLB header is cut short");
  GltfContainer container;
  container.is_binary = true;
  container.version = static_cast<unsigned>(word(bytes, 4));
  if (container.version != 2) return container;
  const std::uint64_t promised = word(bytes, 8);
  if (promised > bytes.size())
    return failure("its GLB header promises " + std::to_string(promised) + " bytes, the file holds " +
                   std::to_string(bytes.size()));
  if (!holds_chunk(bytes, kHeaderBytes, promised)) return failure("its JSON chunk is cut short");
  if (word(bytes, kHeaderBytes + 4) != kJson) return failure("its first chunk is not JSON");
  const std::uint64_t json_bytes = word(bytes, kHeaderBytes);
  container.json = bytes.substr(kHeaderBytes + kChunkBytes, json_bytes);
  const std::uint64_t next = kHeaderBytes + kChunkBytes + json_bytes;
  if (next != promised && !holds_chunk(bytes, next, promised))
    return failure("its binary chunk is cut short");
  return container;
}

}  // namespace

GltfContainer open_gltf_container(std::string_view bytes) {
  if (bytes.starts_with("glTF")) return open_binary(bytes);
  GltfContainer container;
  container.json = bytes;
  return container;
}

}  // namespace tandem::build
