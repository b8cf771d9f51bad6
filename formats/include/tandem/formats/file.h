#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/formats/block.h"

/// The structs that a .bvh file, version 1, consists of. formats/FORMAT.md is the byte-level specification.
namespace tandem {

inline constexpr std::uint8_t kMagic[8] = {0x89, 'B', 'V', 'H', '\r', '\n', 0x1A, '\n'};
inline constexpr std::uint32_t kByteOrder = 0x01020304u;
inline constexpr std::uint16_t kVersionMajor = 1;
inline constexpr std::uint16_t kVersionMinor = 0;
inline constexpr std::uint64_t kSectionAlignment = 256;
inline constexpr std::uint32_t kMaxLevels = 32;
inline constexpr std::uint32_t kMaxSections = 6 * kMaxLevels + 4;

/// Bytes 0 to 127 of a file. The section table follows.
///
///     0        8        16       24       32                 56           68           80
///     | magic  | hash   |order|ver| bytes | origin x y z f64 | lower f32x3 | upper f32x3 | counts, error,
///     zeros ... 128
struct FileHeader {
  std::uint8_t magic[8];
  std::uint64_t hash;        ///< xxh64 of bytes 16 to file_bytes - 1
  std::uint32_t byte_order;  ///< kByteOrder
  std::uint16_t version_major, version_minor;
  std::uint64_t file_bytes;
  double origin[3];            ///< file coordinates = stored coordinates + origin
  float lower[3], upper[3];    ///< bounds of level 0's triangles, stored coordinates, exact
  std::uint64_t source_faces;  ///< faces of the source file, before triangulation and cleaning
  double rounding_error;       ///< largest |stored + origin - source| of a coordinate
  std::uint32_t section_count, level_count;
  std::uint64_t source_vertices;  ///< vertices of the source file; 0: no level has source_vertices
  std::uint8_t reserved[16];      ///< zero
};
static_assert(sizeof(FileHeader) == 128 && offsetof(FileHeader, byte_order) == 16 &&
              offsetof(FileHeader, origin) == 32 && offsetof(FileHeader, lower) == 56 &&
              offsetof(FileHeader, source_faces) == 80 && offsetof(FileHeader, section_count) == 96 &&
              offsetof(FileHeader, source_vertices) == 104);

enum class SectionKind : std::uint32_t {
  levels = 1,           ///< Level[level_count], one for the file
  blocks = 2,           ///< Block[], one for each level
  triangles = 3,        ///< Triangle[], one for each level
  parts = 4,            ///< Part[], one for the file
  strings = 5,          ///< UTF-8 bytes that parts refer to, one for the file
  provenance = 6,       ///< JSON, UTF-8, one for the file
  oriented_blocks = 7,  ///< OrientedBlock[], at most one for each level: what exact queries on a GPU walk
  topology = 8,         ///< TriangleTopology[], at most one for each level: what contact manifolds need
  components = 9,       ///< SurfaceComponent[], one for each level that has topology
  /// std::uint32_t[], at most one for each level that has topology: the source vertex of each vertex.
  /// Refitting needs it.
  source_vertices = 10,
};

/// One row of the section table.
struct Section {
  SectionKind kind;
  std::uint32_t level;   ///< 0 for sections of the whole file
  std::uint64_t offset;  ///< from the start of the file, a multiple of kSectionAlignment
  std::uint64_t bytes;   ///< count times the size of an element
  std::uint64_t count;   ///< elements
};
static_assert(sizeof(Section) == 32);

/// One level of detail: its own blocks and triangles. Level 0 is the full mesh, each further level a coarser
/// one within its bounds.
struct Level {
  std::uint32_t triangle_count;
  std::uint32_t block_count;
  std::uint32_t leaf_block_count;
  std::uint32_t depth;  ///< blocks from the root block to the deepest leaf block, both counted
  double error_bound;   ///< upper bound of the distance of the level's surface from level 0's; 0 for level 0,
                        ///< ascending
  std::uint32_t vertex_count;  ///< of the topology; 0: the level has none
  std::uint32_t flags;         ///< kClosedLevel or 0
};
static_assert(sizeof(Level) == 32);

/// This flag is set where all components of the level are closed.
inline constexpr std::uint32_t kClosedLevel = 1;

/// A triangle, three float4, relative to the asset's origin. Triangles lie in leaf order, so those below a
/// block are consecutive.
struct alignas(16) Triangle {
  struct Corner {
    float position[3];
    std::uint32_t w;
  };
  Corner corner[3];

  TANDEM_HD std::uint32_t source_face() const {
    return corner[0].w;
  }                                                             ///< index of the face in the source file
  TANDEM_HD std::uint32_t part() const { return corner[1].w; }  ///< index of the source part
  // corner[2].w is reserved and zero.
};
static_assert(sizeof(Triangle) == 48 && alignof(Triangle) == 16);

/// A run of source faces that the source file gives a name: an object, a group, a mesh at a scene node.
struct Part {
  std::uint32_t name_offset, name_bytes;  ///< in the strings section
  std::uint32_t path_offset, path_bytes;  ///< scene nodes from the root, joined by '/'
  std::uint64_t first_face, face_count;
};
static_assert(sizeof(Part) == 32);

}  // namespace tandem
