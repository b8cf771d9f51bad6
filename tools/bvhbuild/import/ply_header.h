#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::build {

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t ply_type_bytes(PlyType type);
inline bool is_real(PlyType type) {
  return type == PlyType::float32 || type == PlyType::float64;
}

struct PlyProperty {
  std::string_view name;
  PlyType type;
  bool is_list = false;
  PlyType count_type = PlyType::uint8;  ///< of a list's length
};

struct PlyElement {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

/// What a PLY file says of itself before its data. The names look into the file's bytes.
struct PlyHeader {
  PlyFormat format = PlyFormat::ascii;
  std::vector<PlyElement> elements;
  std::size_t data_begin = 0;  ///< offset of the first byte after the header
};

/// Reads the header of a PLY file into `header`.
///
/// How lines end is decided by the first one, so that binary data may begin with a byte that looks like a
/// line end.
/// Result: empty, or the reason why the header cannot be read, with its line.
std::string read_ply_header(std::string_view bytes, PlyHeader& header);

}  // namespace tandem::build
