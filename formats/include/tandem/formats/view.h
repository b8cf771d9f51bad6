#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "tandem/formats/file.h"
#include "tandem/formats/oriented_block.h"
#include "tandem/formats/topology.h"

namespace tandem {

/// Looks at one level of detail of an asset; owns nothing. Its pointers are of the CPU or of the GPU.
struct LevelView {
  const Block* blocks = nullptr;                   ///< block 0 is the root; the others follow depth first
  const Triangle* triangles = nullptr;             ///< in leaf order: those below a block are consecutive
  const OrientedBlock* oriented_blocks = nullptr;  ///< block_count of them, or null: the file has none
  const TriangleTopology* topology = nullptr;      ///< triangle_count of them, or null: the file has none
  const SurfaceComponent* components = nullptr;    ///< component_count of them; null where topology is
  std::uint32_t block_count = 0;
  std::uint32_t triangle_count = 0;
  std::uint32_t leaf_block_count = 0;
  std::uint32_t depth = 0;
  std::uint32_t component_count = 0;
  std::uint32_t vertex_count = 0;  ///< different positions of corners; 0 where there is no topology
  bool closed = false;             ///< all components are; false where there is no topology
  double error_bound = 0;
};

/// Looks at a checked asset in CPU memory; owns nothing and lives no longer than the bytes.
struct AssetView {
  const FileHeader* header = nullptr;
  std::span<const Section> sections;
  std::span<const Level> levels;
  std::span<const Part> parts;
  std::string_view strings;
  std::string_view provenance;  ///< JSON

  /// Level `i` of detail. Condition: i < levels.size().
  LevelView level(std::uint32_t i = 0) const;

  std::string_view name_of(const Part& part) const {
    return strings.substr(part.name_offset, part.name_bytes);
  }
  std::string_view path_of(const Part& part) const {
    return strings.substr(part.path_offset, part.path_bytes);
  }
};

}  // namespace tandem
