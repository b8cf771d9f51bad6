#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "tandem/formats/file.h"
#include "tandem/formats/oriented_block.h"
#include "tandem/formats/topology.h"

namespace tandem {

/// The corners of a triangle as the float64 numbers that they are, where Triangle holds them rounded.
struct PreciseCorners {
  double position[3][3];
};

/// Looks at one level of detail of an asset; owns nothing. Its pointers are of the CPU or of the GPU.
struct LevelView {
  const Block* blocks = nullptr;                   ///< block 0 is the root; the others follow depth first
  const Triangle* triangles = nullptr;             ///< in leaf order: those below a block are consecutive
  const OrientedBlock* oriented_blocks = nullptr;  ///< block_count of them, or null: the file has none
  const TriangleTopology* topology = nullptr;      ///< triangle_count of them, or null: the file has none
  const SurfaceComponent* components = nullptr;    ///< component_count of them; null where topology is
  const std::uint32_t* source_vertices = nullptr;  ///< of each vertex; null: the level cannot be refitted
  const PreciseCorners* precise = nullptr;         ///< of each triangle of a deformed tree; null: as stored
  std::uint32_t block_count = 0;
  std::uint32_t triangle_count = 0;
  std::uint32_t leaf_block_count = 0;
  std::uint32_t depth = 0;
  std::uint32_t component_count = 0;
  std::uint32_t vertex_count = 0;  ///< of the topology; 0 where there is none
  bool closed = false;             ///< all components are; false where there is no topology
  std::uint32_t number = 0;        ///< of the file's levels; 0 is the finest
  double error_bound = 0;          ///< of the distance from the file's level 0, in stored coordinates
};

/// Looks at a checked asset in CPU memory, or at a run of its levels; owns nothing and lives no longer than
/// the bytes.
struct AssetView {
  const FileHeader* header = nullptr;
  std::span<const Section> sections;  ///< all of the file
  std::span<const Level> levels;      ///< those that the view shows, from the finest on
  std::uint32_t first_level = 0;      ///< the file's number of the first of them
  std::span<const Part> parts;
  std::string_view strings;
  std::string_view provenance;  ///< JSON

  /// Level `i` of those that the view shows. Condition: i < levels.size().
  LevelView level(std::uint32_t i = 0) const;

  /// A view of `count` levels from level `first` of this view on, or of as many as there are. Whatever takes
  /// level 0 of a view then takes that level: queries run at it, and upload() copies the shown levels alone.
  /// Condition: first < levels.size(), count > 0.
  AssetView levels_from(std::uint32_t first, std::uint32_t count = kMaxLevels) const;

  /// The coarsest level that the view shows whose error_bound is at most `tolerance`, in units of length; 0
  /// where none is, as for NaN.
  std::uint32_t coarsest_level(double tolerance) const;

  std::string_view name_of(const Part& part) const {
    return strings.substr(part.name_offset, part.name_bytes);
  }
  std::string_view path_of(const Part& part) const {
    return strings.substr(part.path_offset, part.path_bytes);
  }
};

}  // namespace tandem
