#include "tandem/formats/check.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "check_level.h"
#include "tandem/formats/hash.h"

namespace tandem {
namespace {

constexpr std::size_t kHashedFrom = offsetof(FileHeader, byte_order);

Status check_identity(const unsigned char* data, std::size_t bytes) {
  constexpr char kMotionCapture[] = "HIERARCHY";
  if (bytes >= 9 && std::memcmp(data, kMotionCapture, 9) == 0) return Status::kBiovisionMotionCapture;
  if (bytes < 4 || std::memcmp(data, kMagic, 4) != 0) return Status::kNotTandem;
  if (std::memcmp(data, kMagic, std::min<std::size_t>(bytes, 8)) != 0) return Status::kDamagedByTextTransfer;
  if (bytes < sizeof(FileHeader)) return Status::kTruncated;
  const auto& header = *reinterpret_cast<const FileHeader*>(data);
  if (header.byte_order != kByteOrder) return Status::kWrongByteOrder;
  if (header.version_major != kVersionMajor || header.version_minor > kVersionMinor)
    return Status::kUnsupportedVersion;
  if (bytes < header.file_bytes || header.file_bytes < sizeof(FileHeader)) return Status::kTruncated;
  if (bytes > header.file_bytes) return Status::kTrailingBytes;
  if (xxh64(data + kHashedFrom, bytes - kHashedFrom) != header.hash) return Status::kContentChanged;
  return Status::kOk;
}

bool all_zero(const std::uint8_t* from, const std::uint8_t* to) {
  return std::all_of(from, to, [](std::uint8_t byte) { return byte == 0; });
}

Status check_header(const FileHeader& header) {
  bool sound = all_zero(header.reserved, header.reserved + sizeof header.reserved);
  sound = sound && header.level_count >= 1 && header.level_count <= kMaxLevels &&
          header.section_count <= kMaxSections;
  sound = sound && header.source_faces >= 1 && header.source_faces < kNoIndex;
  sound = sound && header.source_vertices <= kNoIndex;
  sound = sound && std::isfinite(header.rounding_error) && header.rounding_error >= 0;
  for (int k = 0; k < 3; ++k) sound = sound && std::isfinite(header.origin[k]);
  if (!sound) return Status::kBadHeader;
  const std::uint64_t table_end = sizeof(FileHeader) + header.section_count * sizeof(Section);
  return table_end <= header.file_bytes ? Status::kOk : Status::kBadSectionTable;
}

struct SectionRule {
  SectionKind kind;
  std::uint64_t element_bytes;
  bool is_of_level;  // else of the whole file
};

constexpr SectionRule kSectionRules[] = {
    {SectionKind::levels, sizeof(Level), false},
    {SectionKind::blocks, sizeof(Block), true},
    {SectionKind::triangles, sizeof(Triangle), true},
    {SectionKind::parts, sizeof(Part), false},
    {SectionKind::strings, 1, false},
    {SectionKind::provenance, 1, false},
    {SectionKind::oriented_blocks, sizeof(OrientedBlock), true},
    {SectionKind::topology, sizeof(TriangleTopology), true},
    {SectionKind::components, sizeof(SurfaceComponent), true},
    {SectionKind::source_vertices, sizeof(std::uint32_t), true},
};

Status check_section(const Section& section, const FileHeader& header) {
  const auto rule = std::find_if(std::begin(kSectionRules), std::end(kSectionRules),
                                 [&](const SectionRule& known) { return known.kind == section.kind; });
  if (rule == std::end(kSectionRules) || section.level >= (rule->is_of_level ? header.level_count : 1))
    return Status::kUnknownSection;
  if (section.offset % kSectionAlignment != 0) return Status::kSectionMisaligned;
  if (section.offset > header.file_bytes || section.bytes > header.file_bytes - section.offset) {
    return Status::kSectionOutOfBounds;
  }
  if (section.bytes % rule->element_bytes != 0 || section.bytes / rule->element_bytes != section.count)
    return Status::kSectionSizeMismatch;
  return Status::kOk;
}

// Sections ascend, nothing but zeros lies between them, and the file ends at the first multiple of the
// alignment after the last.
CheckResult check_section_table(const unsigned char* data, const FileHeader& header,
                                std::span<const Section> sections) {
  std::uint64_t end = sizeof(FileHeader) + sections.size_bytes();
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const Section& section = sections[i];
    if (const Status status = check_section(section, header); status != Status::kOk) return {status, i, {}};
    if (section.offset < end) return {Status::kSectionsOverlap, i, {}};
    if (!all_zero(data + end, data + section.offset)) return {Status::kBadGap, end, {}};
    if (section.offset - end >= kSectionAlignment) return {Status::kBadGap, end, {}};
    end = section.offset + section.bytes;
    for (std::size_t j = 0; j < i; ++j) {
      if (sections[j].kind == section.kind && sections[j].level == section.level)
        return {Status::kSectionDuplicated, i, {}};
    }
  }
  const bool ends_aligned =
      header.file_bytes % kSectionAlignment == 0 && header.file_bytes - end < kSectionAlignment;
  if (!ends_aligned || !all_zero(data + end, data + header.file_bytes)) {
    return {Status::kBadGap, end, {}};
  }
  return {};
}

// The elements of a section, or an empty span where the file has none. Sections are in bounds and aligned by
// now.
template <typename Element>
std::span<const Element> elements(const unsigned char* data, std::span<const Section> sections,
                                  SectionKind kind, std::uint32_t level = 0) {
  for (const Section& section : sections) {
    if (section.kind == kind && section.level == level) {
      return {reinterpret_cast<const Element*>(data + section.offset),
              static_cast<std::size_t>(section.count)};
    }
  }
  return {};
}

// Condition: the table lies within the file.
std::span<const Section> sections_of(const unsigned char* data) {
  const auto& header = *reinterpret_cast<const FileHeader*>(data);
  return {reinterpret_cast<const Section*>(data + sizeof(FileHeader)), header.section_count};
}

// Returns whether the counts of a level's topology agree, or all say that there is none.
bool has_sound_topology(const Level& level, std::span<const TriangleTopology> topology,
                        std::span<const SurfaceComponent> components) {
  if (topology.data() == nullptr)
    return components.data() == nullptr && level.vertex_count == 0 && level.flags == 0;
  return topology.size() == level.triangle_count && topology.size() < kMostTopologyTriangles &&
         !components.empty() && components.size() <= topology.size() && level.vertex_count >= 1 &&
         level.vertex_count <= 3 * topology.size() && level.flags <= kClosedLevel;
}

// Returns whether a level has a source vertex for each vertex of its topology, or none at all.
bool has_sound_source_vertices(const Level& level, std::span<const std::uint32_t> source_vertices) {
  return source_vertices.data() == nullptr ||
         (level.vertex_count >= 1 && source_vertices.size() == level.vertex_count);
}

CheckResult check_levels(const unsigned char* data, const FileHeader& header,
                         std::span<const Section> sections, std::span<const Level> levels) {
  if (levels.empty()) return {Status::kSectionMissing, 0, {}};
  if (levels.size() != header.level_count) return {Status::kBadLevel, 0, {}};
  bool names_source_vertices = false;
  for (std::uint32_t i = 0; i < levels.size(); ++i) {
    const Level& level = levels[i];
    const auto blocks = elements<Block>(data, sections, SectionKind::blocks, i);
    const auto triangles = elements<Triangle>(data, sections, SectionKind::triangles, i);
    const auto oriented = elements<OrientedBlock>(data, sections, SectionKind::oriented_blocks, i);
    const auto topology = elements<TriangleTopology>(data, sections, SectionKind::topology, i);
    const auto components = elements<SurfaceComponent>(data, sections, SectionKind::components, i);
    const auto sources = elements<std::uint32_t>(data, sections, SectionKind::source_vertices, i);
    names_source_vertices = names_source_vertices || sources.data() != nullptr;
    if (blocks.empty() || triangles.empty()) return {Status::kSectionMissing, i, {}};
    const double least_error = i == 0 ? 0 : levels[i - 1].error_bound;
    bool sound = blocks.size() == level.block_count && triangles.size() == level.triangle_count;
    sound = sound && level.leaf_block_count <= level.block_count && level.triangle_count < kNoIndex;
    sound = sound && (oriented.data() == nullptr ||
                      (oriented.size() == blocks.size() && triangles.size() < kMostOrientedTriangles));
    sound = sound && has_sound_topology(level, topology, components);
    sound = sound && has_sound_source_vertices(level, sources);
    sound = sound && std::isfinite(level.error_bound) && level.error_bound >= least_error;
    sound = sound && (i > 0 || level.error_bound == 0);
    if (!sound) return {Status::kBadLevel, i, {}};
  }
  if (names_source_vertices != (header.source_vertices > 0)) return {Status::kBadHeader, 0, {}};
  return {};
}

// The lengths of all strings together are bounded, so that a reader which copies them needs no more memory
// than the file has bytes.
CheckResult check_parts(const AssetView& asset) {
  std::uint64_t next_face = 0, string_bytes = 0;
  for (std::size_t i = 0; i < asset.parts.size(); ++i) {
    const Part& part = asset.parts[i];
    const bool strings_in_range = part.name_bytes <= asset.strings.size() &&
                                  part.name_offset <= asset.strings.size() - part.name_bytes &&
                                  part.path_bytes <= asset.strings.size() &&
                                  part.path_offset <= asset.strings.size() - part.path_bytes;
    const bool faces_follow =
        part.first_face == next_face && part.face_count <= asset.header->source_faces - next_face;
    string_bytes += std::uint64_t{part.name_bytes} + part.path_bytes;
    if (!strings_in_range || !faces_follow || string_bytes > asset.strings.size())
      return {Status::kBadPart, i, {}};
    next_face += part.face_count;
  }
  if (asset.parts.empty()) return {Status::kSectionMissing, 0, {}};
  if (next_face != asset.header->source_faces) return {Status::kBadPart, asset.parts.size(), {}};
  return {};
}

struct Bounds {
  float lower[3], upper[3];
};

Bounds bounds_of(const LevelView& level) {
  Bounds bounds;
  auto& [lower, upper] = bounds;
  std::memcpy(lower, level.triangles[0].corner[0].position, sizeof lower);
  std::memcpy(upper, lower, sizeof upper);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    for (const Triangle::Corner& corner : level.triangles[t].corner) {
      for (int k = 0; k < 3; ++k) {
        lower[k] = std::min(lower[k], corner.position[k]);
        upper[k] = std::max(upper[k], corner.position[k]);
      }
    }
  }
  return bounds;
}

// The header has the bounds of level 0, and the other levels lie within them.
CheckResult check_bounds(const AssetView& asset) {
  const FileHeader& header = *asset.header;
  for (std::uint32_t i = 0; i < asset.levels.size(); ++i) {
    const auto [lower, upper] = bounds_of(asset.level(i));
    for (int k = 0; k < 3; ++k) {
      if (i == 0 && !(lower[k] == header.lower[k] && upper[k] == header.upper[k]))
        return {Status::kBoundsMismatch, 0, {}};
      if (!(lower[k] >= header.lower[k] && upper[k] <= header.upper[k]))
        return {Status::kLevelOutsideBounds, i, {}};
    }
  }
  return {};
}

}  // namespace

CheckResult check(const void* data_pointer, std::size_t bytes, CheckDepth depth) {
  const auto* data = static_cast<const unsigned char*>(data_pointer);
  if (reinterpret_cast<std::uintptr_t>(data) % alignof(Block) != 0) return {Status::kMisaligned, 0, {}};
  if (const Status status = check_identity(data, bytes); status != Status::kOk) return {status, 0, {}};
  const auto& header = *reinterpret_cast<const FileHeader*>(data);
  if (const Status status = check_header(header); status != Status::kOk) return {status, 0, {}};

  CheckResult step = check_section_table(data, header, sections_of(data));
  if (step.status != Status::kOk) return step;

  CheckResult result;
  const AssetView& asset = result.asset = view_of_checked(data);
  step = check_levels(data, header, asset.sections, asset.levels);
  if (step.status == Status::kOk) step = check_parts(asset);
  for (std::uint32_t i = 0; i < asset.levels.size() && step.status == Status::kOk; ++i) {
    const LevelView level = asset.level(i);
    step = check_tree(level, header.source_faces, asset.parts);
    if (step.status == Status::kOk && level.oriented_blocks != nullptr)
      step = check_oriented_blocks(level, depth);
    if (step.status == Status::kOk && level.topology != nullptr)
      step = check_topology(level, depth, header.source_vertices, header.hash);
  }
  if (step.status == Status::kOk) step = check_bounds(asset);
  return step.status == Status::kOk ? result : step;
}

// The header and the section table alone are looked at.
AssetView view_of_checked(const void* data_pointer) {
  const auto* data = static_cast<const unsigned char*>(data_pointer);
  AssetView asset;
  asset.header = reinterpret_cast<const FileHeader*>(data);
  asset.sections = sections_of(data);
  asset.levels = elements<Level>(data, asset.sections, SectionKind::levels);
  asset.parts = elements<Part>(data, asset.sections, SectionKind::parts);
  const auto strings = elements<char>(data, asset.sections, SectionKind::strings);
  const auto provenance = elements<char>(data, asset.sections, SectionKind::provenance);
  asset.strings = {strings.data(), strings.size()};
  asset.provenance = {provenance.data(), provenance.size()};
  return asset;
}

void seal(void* data, std::size_t bytes) {
  auto* header = static_cast<FileHeader*>(data);
  header->hash = xxh64(static_cast<const unsigned char*>(data) + kHashedFrom, bytes - kHashedFrom);
}

}  // namespace tandem
