#include "assemble.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bvhbuild/meshing/meshing.h"
#include "parallel/parallel.h"
#include "tandem/formats/allocator.h"
#include "tandem/formats/check.h"

namespace tandem::build {
namespace {

constexpr std::size_t kBytesAtOnce = 1 << 20;

std::uint64_t align_up(std::uint64_t offset) {
  return (offset + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
}

// The section table, with offsets in the order in which sections are added.
class Plan {
 public:
  explicit Plan(std::size_t section_count)
      : end_(sizeof(FileHeader) + section_count * sizeof(Section)), expected_(section_count) {}

  void add(SectionKind kind, std::uint32_t level, std::uint64_t count, std::uint64_t element_bytes) {
    const std::uint64_t offset = align_up(end_);
    sections_.push_back({kind, level, offset, count * element_bytes, count});
    end_ = offset + count * element_bytes;
  }

  const std::vector<Section>& sections() const {
    if (sections_.size() != expected_)
      throw std::logic_error("the section table has another size than planned");
    return sections_;
  }
  std::uint64_t file_bytes() const { return align_up(end_); }

 private:
  std::vector<Section> sections_;
  std::uint64_t end_;
  std::size_t expected_;
};

// Names and paths of the parts, one after the other.
struct PartTable {
  std::vector<Part> parts;
  std::string strings;

  explicit PartTable(std::span<const SourcePart> source) {
    for (const SourcePart& part : source) {
      Part row{};
      append(part.name, row.name_offset, row.name_bytes);
      append(part.node_path, row.path_offset, row.path_bytes);
      row.first_face = part.first_face;
      row.face_count = part.face_count;
      parts.push_back(row);
    }
  }

 private:
  void append(const std::string& text, std::uint32_t& offset, std::uint32_t& bytes) {
    if (strings.size() + text.size() >= kNoIndex)
      throw std::length_error("the names of the parts exceed 4 GiB");
    offset = static_cast<std::uint32_t>(strings.size());
    bytes = static_cast<std::uint32_t>(text.size());
    strings += text;
  }
};

std::uint32_t part_of(std::span<const Part> parts, std::uint32_t face) {
  const auto after = std::upper_bound(parts.begin(), parts.end(), face,
                                      [](std::uint32_t f, const Part& part) { return f < part.first_face; });
  return static_cast<std::uint32_t>(after - parts.begin() - 1);
}

void write_triangles(const AssetLevel& level, std::span<const Part> parts, Triangle* out) {
  const std::vector<std::uint32_t>& order = level.tree->order;
  parallel::for_parts(order.size(), kTrianglesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t != end; ++t) {
      Triangle triangle{};
      for (int i = 0; i < 3; ++i) {
        const auto& point = level.geometry.points[level.geometry.triangles[order[t]][i]];
        std::copy(point.begin(), point.end(), triangle.corner[i].position);
      }
      triangle.corner[0].w = level.face[order[t]];
      triangle.corner[1].w = part_of(parts, level.face[order[t]]);
      out[t] = triangle;
    }
  });
}

Plan plan_sections(const PartTable& table, const AssetSource& source, std::span<const AssetLevel> levels) {
  std::size_t optional = 0;
  for (const AssetLevel& level : levels)
    optional += (level.oriented_blocks.empty() ? 0 : 1) + (level.topology == nullptr ? 0 : 2) +
                (level.can_be_refitted() ? 1 : 0);
  Plan plan(2 * levels.size() + optional + 4);
  plan.add(SectionKind::levels, 0, levels.size(), sizeof(Level));
  for (std::uint32_t i = 0; i < levels.size(); ++i) {
    // The sections that exact queries on a GPU need lie together, for one copy, and behind it what manifolds
    // need too, and what refitting needs.
    plan.add(SectionKind::blocks, i, levels[i].tree->blocks.size(), sizeof(Block));
    plan.add(SectionKind::triangles, i, levels[i].geometry.triangles.size(), sizeof(Triangle));
    if (!levels[i].oriented_blocks.empty())
      plan.add(SectionKind::oriented_blocks, i, levels[i].oriented_blocks.size(), sizeof(OrientedBlock));
    if (const SurfaceTopology* topology = levels[i].topology; topology != nullptr) {
      plan.add(SectionKind::topology, i, topology->triangles.size(), sizeof(TriangleTopology));
      plan.add(SectionKind::components, i, topology->components.size(), sizeof(SurfaceComponent));
    }
    if (levels[i].can_be_refitted())
      plan.add(SectionKind::source_vertices, i, levels[i].topology->vertex_count, sizeof(std::uint32_t));
  }
  plan.add(SectionKind::parts, 0, table.parts.size(), sizeof(Part));
  plan.add(SectionKind::strings, 0, table.strings.size(), 1);
  plan.add(SectionKind::provenance, 0, source.provenance.size(), 1);
  return plan;
}

FileHeader make_header(const AssetSource& source, std::span<const AssetLevel> levels, const Plan& plan) {
  FileHeader header{};
  std::copy_n(kMagic, sizeof kMagic, header.magic);
  header.byte_order = kByteOrder;
  header.version_major = kVersionMajor;
  header.version_minor = kVersionMinor;
  header.file_bytes = plan.file_bytes();
  std::copy(source.origin.begin(), source.origin.end(), header.origin);
  const CornerBounds bounds = corner_bounds(levels[0].geometry);
  std::copy_n(bounds.lower.begin(), 3, header.lower);
  std::copy_n(bounds.upper.begin(), 3, header.upper);
  header.source_faces = source.source_faces;
  header.rounding_error = source.rounding_error;
  header.section_count = static_cast<std::uint32_t>(plan.sections().size());
  header.level_count = static_cast<std::uint32_t>(levels.size());
  if (std::any_of(levels.begin(), levels.end(), std::mem_fn(&AssetLevel::can_be_refitted)))
    header.source_vertices = source.source_vertices;
  return header;
}

Level make_level(const AssetLevel& level) {
  Level row{};
  row.triangle_count = static_cast<std::uint32_t>(level.geometry.triangles.size());
  row.block_count = static_cast<std::uint32_t>(level.tree->blocks.size());
  row.leaf_block_count = level.tree->leaf_block_count;
  row.depth = level.tree->depth;
  row.error_bound = level.error_bound;
  if (level.topology != nullptr) {
    row.vertex_count = level.topology->vertex_count;
    row.flags = level.topology->closed ? kClosedLevel : 0;
  }
  return row;
}

std::vector<std::uint32_t> source_vertices(const AssetLevel& level) {
  std::vector<std::uint32_t> source;
  source.reserve(level.topology->vertex_count);
  for (const std::uint32_t point : level.topology->point) source.push_back(level.source_vertex[point]);
  return source;
}

// Copies into the image and checks that the copy fills its section exactly.
template <typename Rows>
void fill(Image& image, const Section& section, const Rows& rows) {
  const std::size_t bytes = std::size(rows) * sizeof(*std::data(rows));
  if (bytes != section.bytes) throw std::logic_error("a section has another size than planned");
  if (bytes != 0) std::memcpy(image.data() + section.offset, std::data(rows), bytes);
}

void write_section(const Section& section, const AssetSource& source, std::span<const AssetLevel> levels,
                   const PartTable& table, Image& image) {
  const AssetLevel& level = levels[section.level];
  std::vector<Level> rows;
  switch (section.kind) {
    case SectionKind::levels:
      for (const AssetLevel& each : levels) rows.push_back(make_level(each));
      return fill(image, section, rows);
    case SectionKind::blocks:
      return fill(image, section, level.tree->blocks);
    case SectionKind::oriented_blocks:
      return fill(image, section, level.oriented_blocks);
    case SectionKind::topology:
      return fill(image, section, level.topology->triangles);
    case SectionKind::components:
      return fill(image, section, level.topology->components);
    case SectionKind::source_vertices:
      return fill(image, section, source_vertices(level));
    case SectionKind::triangles:
      return write_triangles(level, table.parts, reinterpret_cast<Triangle*>(image.data() + section.offset));
    case SectionKind::parts:
      return fill(image, section, table.parts);
    case SectionKind::strings:
      return fill(image, section, table.strings);
    case SectionKind::provenance:
      return fill(image, section, source.provenance);
  }
}

}  // namespace

Image::Image(std::size_t bytes) : data_(static_cast<std::byte*>(allocate(bytes))), size_(bytes) {
  if (data_ == nullptr) throw std::bad_alloc();
  parallel::for_parts(bytes, kBytesAtOnce, [&](std::size_t begin, std::size_t end) {
    std::memset(data_.get() + begin, 0, end - begin);
  });
}

void Image::Delete::operator()(std::byte* data) const {
  deallocate(data);
}

Image assemble(const AssetSource& source, std::span<const AssetLevel> levels) {
  const PartTable table(source.parts);
  const Plan plan = plan_sections(table, source, levels);
  Image image(plan.file_bytes());
  const FileHeader header = make_header(source, levels, plan);
  std::memcpy(image.data(), &header, sizeof header);
  std::memcpy(image.data() + sizeof header, plan.sections().data(), plan.sections().size() * sizeof(Section));
  parallel::for_each(plan.sections().size(),
                     [&](std::size_t i) { write_section(plan.sections()[i], source, levels, table, image); });
  seal(image.data(), image.size());
  return image;
}

LevelParts build_parts(const Geometry& geometry, const BuildOptions& options, OptimisationWatch& watch) {
  LevelParts parts;
  parts.tree = build_tree(geometry, options.imaginary, options.effort, watch);
  watch.reach(build_shares(options.effort).emitted);
  const std::size_t triangles = geometry.triangles.size();
  parallel::invoke(  // topology takes one thread, about as long as a fast search
      [&] {
        if (options.topology && triangles < kMostTopologyTriangles)
          parts.topology = make_topology(options.refit ? geometry : geometry.sample(0), parts.tree);
      },
      [&] {
        if (options.gpu_blocks && triangles < kMostOrientedTriangles)
          parts.oriented_blocks = orient_blocks(geometry, parts.tree, options.effort);
      });
  watch.reach(build_shares(options.effort).topology);
  return parts;
}

CheckedImage assemble_checked(const AssetSource& source, std::span<const AssetLevel> levels) {
  Image image = assemble(source, levels);
  const CheckResult checked = check(image.data(), image.size());
  if (checked.status != Status::kOk)
    throw std::logic_error(std::string("the tree that was built is not sound: ") + explain(checked.status));
  return {std::move(image), checked.asset};
}

}  // namespace tandem::build
