#include "page.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <utility>

#include "common/number_words.h"
#include "common/path_text.h"
#include "common/printable.h"
#include "levels/level_bytes.h"

namespace tandem {
namespace {

constexpr std::size_t kPartsShown = 12;

constexpr std::pair<SectionKind, const char*> kSectionKinds[] = {
    {SectionKind::levels, "levels"},
    {SectionKind::blocks, "blocks"},
    {SectionKind::triangles, "triangles"},
    {SectionKind::parts, "parts"},
    {SectionKind::strings, "strings"},
    {SectionKind::provenance, "provenance"},
    {SectionKind::oriented_blocks, "oriented_blocks"},
    {SectionKind::topology, "topology"},
    {SectionKind::source_vertices, "source_vertices"},
    {SectionKind::components, "components"},
};

const char* name(SectionKind kind) {
  for (const auto& [known, name] : kSectionKinds) {
    if (known == kind) return name;
  }
  return "unknown";
}

Json sections_json(const AssetView& view) {
  Json sections = Json::array();
  for (const Section& s : view.sections) {
    sections.push_back({{"kind", name(s.kind)},
                        {"level", s.level},
                        {"offset", s.offset},
                        {"bytes", s.bytes},
                        {"count", s.count}});
  }
  return sections;
}

Json surface_json(const SurfaceCounts& counts) {
  return {{"vertices", counts.vertices},
          {"components", counts.components},
          {"closed_components", counts.closed_components},
          {"turned_triangles", counts.turned_triangles},
          {"boundary_edges", counts.boundary_edges},
          {"sides_at_edges_of_many", counts.sides_at_edges_of_many}};
}

/// The keys of docs/json.md, null where nothing was sampled.
Json work_json(const ExpectedWork& work) {
  const bool sampled = work.poses > 0;
  const auto& oriented = work.oriented;
  return {{"expected_block_pairs", sampled ? Json(work.block_pairs) : Json()},
          {"expected_candidates", sampled ? Json(work.candidates) : Json()},
          {"expected_oriented_block_pairs", oriented ? Json(oriented->block_pairs) : Json()},
          {"expected_oriented_candidates", oriented ? Json(oriented->candidates) : Json()}};
}

/// Returns the diagonal of the bounds of level 0.
double diagonal(const FileHeader& header) {
  double square = 0;
  for (int k = 0; k < 3; ++k) {
    const double side = double{header.upper[k]} - double{header.lower[k]};
    square += side * side;
  }
  return std::sqrt(square);
}

Json levels_json(const Inspection& inspection) {
  const AssetView& view = inspection.asset.view();
  Json levels = Json::array();
  for (std::uint32_t i = 0; i < view.levels.size(); ++i) {
    const LevelView level = view.level(i);
    const double relative = level.error_bound / diagonal(*view.header);
    Json json = {{"triangles", level.triangle_count},
                 {"blocks", level.block_count},
                 {"depth", level.depth},
                 {"bytes", bytes_of_level(view, i)},
                 {"error_bound", level.error_bound},
                 {"error_bound_relative", std::isfinite(relative) ? Json(relative) : Json()},
                 {"closed", level.topology != nullptr ? Json(level.closed) : Json()}};
    json.update(work_json(inspection.work[i]));
    levels.push_back(std::move(json));
  }
  return levels;
}

Json parts_json(const AssetView& view) {
  Json parts = Json::array();
  for (const Part& part : view.parts) {
    parts.push_back({{"name", view.name_of(part)},
                     {"path", view.path_of(part)},
                     {"first_face", part.first_face},
                     {"face_count", part.face_count}});
  }
  return parts;
}

std::string point(const float* p) {
  return format("(%.7g, %.7g, %.7g)", p[0], p[1], p[2]);
}
std::string point(const double* p) {
  return format("(%.12g, %.12g, %.12g)", p[0], p[1], p[2]);
}

/// Text that a file brings along, or the name of one, fit for a terminal.
std::string harmless(std::string_view text) {
  return printable(text);
}

// The string under a key, without throwing at what some other tool may have put there.
std::string text_of(const Json& json, const char* key) {
  const auto found = json.is_object() ? json.find(key) : json.end();
  if (!json.is_object() || found == json.end()) return "?";
  return harmless(found->is_string() ? found->get<std::string>() : found->dump());
}

void add_source(const Json& source, Report& report) {
  if (!source.is_object() || !source.contains("input")) {
    report.row("source", "unknown");
    return;
  }
  const Json& input = source["input"];
  report.row("source", text_of(input, "file") + ", " + text_of(input, "bytes") + " bytes, XXH64 " +
                           text_of(input, "xxh64") + ", read by " + text_of(input, "reader"));
  std::string built = text_of(source, "tool") + " " + text_of(source, "version");
  if (source.contains("options")) {
    const Json& options = source["options"];
    built += ", imaginary nodes " + text_of(options, "imaginary") + ", effort " + text_of(options, "effort");
    const bool interrupted = options.is_object() && options.value("interrupted", Json()) == true;
    if (interrupted) built += ", interrupted: the best tree until then";
  }
  report.row("built by", built);
  if (source.contains("samples")) report.row("samples", samples_words(source["samples"]));
}

std::string faces_of(const Part& part) {
  if (part.face_count == 0) return "no faces";
  if (part.face_count == 1) return "face " + with_commas(part.first_face);
  return "faces " + with_commas(part.first_face) + " to " +
         with_commas(part.first_face + part.face_count - 1);
}

void add_parts(const AssetView& view, Report& report) {
  report.row("parts", std::to_string(view.parts.size()));
  for (std::size_t i = 0; i < std::min(view.parts.size(), kPartsShown); ++i) {
    const Part& part = view.parts[i];
    const std::string path = harmless(view.path_of(part));
    const std::string name = harmless(view.name_of(part));
    report.row(" ", (path.empty() ? "" : path + " : ") + (name.empty() ? "(no name)" : name) + "  " +
                        faces_of(part));
  }
  if (view.parts.size() > kPartsShown)
    report.row(" ", format("and %zu more", view.parts.size() - kPartsShown));
}

void add_work(const LevelView& level, const ExpectedWork& work, Report& report) {
  report.row("query work", work.poses == 0
                               ? "not sampled: the mesh overlaps itself too much, or is too large"
                               : format("%.1f block pairs, %.1f candidates expected near contact (%u poses)",
                                        work.block_pairs, work.candidates, work.poses));
  if (work.oriented)
    report.row("on a GPU", format("%.1f oriented block pairs, %.1f candidates", work.oriented->block_pairs,
                                  work.oriented->candidates));
  if (level.oriented_blocks == nullptr)
    report.row("on a GPU", "no exact queries: the file has no oriented blocks");
}

std::string surface_words(const std::optional<SurfaceCounts>& surface) {
  if (!surface) return "no topology: contact manifolds refuse the file";
  std::string text = with_commas(surface->vertices) + " vertices, " + with_commas(surface->components) +
                     (surface->components == 1 ? " component, " : " components, ");
  if (surface->closed_components == surface->components) {
    text += "closed";
  } else {
    text += with_commas(surface->closed_components) + " closed, " + with_commas(surface->boundary_edges) +
            " boundary edges";
  }
  if (surface->sides_at_edges_of_many != 0)
    text +=
        ", " + with_commas(surface->sides_at_edges_of_many) + " sides at edges of more than two triangles";
  if (surface->turned_triangles != 0)
    text += ", " + with_commas(surface->turned_triangles) + " triangles taken to be wound the other way";
  return text;
}

void add_tree(const TreeStatistics& tree, Report& report) {
  report.row("triangles", with_commas(tree.triangles));
  report.row("nodes", with_commas(tree.nodes) + ": " + with_commas(tree.leaf_nodes) + " leaves, " +
                          with_commas(tree.internal_nodes) + " internal, " +
                          with_commas(tree.imaginary_nodes) +
                          format(" imaginary (%.2f %%, minimum %llu)", 100 * tree.imaginary_fraction,
                                 static_cast<unsigned long long>(tree.imaginary_minimum)));
  report.row("blocks", with_commas(tree.leaf_blocks) + " leaf, " + with_commas(tree.internal_blocks) +
                           " internal, " + with_commas(tree.partial_leaf_blocks) + " partial leaf blocks");
  report.row("depth", format("%u blocks", tree.depth));
  report.row("leaf fill", format("%.2f %%", 100 * tree.leaf_fill));
  report.row("SAH cost", format("%.3f", tree.sah_cost));
}

std::string bar(std::uint64_t count, std::uint64_t largest) {
  constexpr std::uint64_t kWidth = 40;
  const std::uint64_t length = largest == 0 ? 0 : (count * kWidth + largest - 1) / largest;
  return std::string(length, '#');
}

template <typename Counts>
void add_histogram(const char* title, const Counts& counts, std::size_t first, std::size_t label_offset,
                   Report& report) {
  const std::uint64_t largest = *std::max_element(std::begin(counts), std::end(counts));
  report.line(std::string("  ") + title);
  for (std::size_t i = first; i < std::size(counts); ++i) {
    if (counts[i] == 0) continue;
    report.line(format("  %11zu  %12s  ", i + label_offset, with_commas(counts[i]).c_str()) +
                bar(counts[i], largest));
  }
}

std::string refit_words(const FileHeader& header) {
  if (header.source_vertices == 0) return "no source vertices: the tree cannot be refitted to a bent mesh";
  return "to positions of " + with_commas(header.source_vertices) + " source vertices";
}

void add_section_lines(const AssetView& view, Report& report) {
  report.line("  sections");
  for (const Section& section : view.sections) {
    report.line(format("  %15s  level %u  offset %12s  %12s bytes  %10s elements", name(section.kind),
                       section.level, with_commas(section.offset).c_str(), with_commas(section.bytes).c_str(),
                       with_commas(section.count).c_str()));
  }
}

/// Levels side by side.
void add_level_lines(const Json& levels, Report& report) {
  report.line(
      "  levels       triangles     blocks  depth         bytes  error bound  of diagonal  block pairs");
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const Json& level = levels[i];
    const Json &relative = level["error_bound_relative"], &pairs = level["expected_block_pairs"],
               &closed = level["closed"];
    report.line(
        format("  %6zu %15s %10s %6u %13s  %11.5g  %11s  %11s%s", i,
               with_commas(level["triangles"].get<std::uint64_t>()).c_str(),
               with_commas(level["blocks"].get<std::uint64_t>()).c_str(), level["depth"].get<unsigned>(),
               with_commas(level["bytes"].get<std::uint64_t>()).c_str(), level["error_bound"].get<double>(),
               relative.is_null() ? "-" : format("%.3g %%", 100 * relative.get<double>()).c_str(),
               pairs.is_null() ? "-" : format("%.1f", pairs.get<double>()).c_str(),
               closed == true ? "  closed" : ""));
  }
}

// The figures that people compare when they tune, in the order of the page.
constexpr const char* kCompared[] = {"bytes",
                                     "triangles",
                                     "nodes",
                                     "leaf_nodes",
                                     "internal_nodes",
                                     "imaginary_nodes",
                                     "imaginary_minimum",
                                     "imaginary_fraction",
                                     "leaf_blocks",
                                     "internal_blocks",
                                     "depth",
                                     "leaf_fill",
                                     "sah_cost",
                                     "expected_block_pairs",
                                     "expected_candidates",
                                     "expected_oriented_block_pairs",
                                     "expected_oriented_candidates",
                                     "rounding_error"};

std::string figure(const Json& value) {
  if (value.is_null()) return "-";
  return value.is_number_integer() ? with_commas(value.get<std::uint64_t>())
                                   : format("%.4g", value.get<double>());
}

}  // namespace

Report report_of(const Inspection& inspection) {
  const AssetView& view = inspection.asset.view();
  const FileHeader& header = *view.header;
  const std::string version =
      std::to_string(header.version_major) + "." + std::to_string(header.version_minor);
  Report report(12, 0);
  report.line(harmless(inspection.path) + ": Tandem tree, format " + version + ", " +
              human_bytes(header.file_bytes) + ", hash " + hexadecimal(header.hash));
  report.add({{"file", inspection.path},
              {"version", version},
              {"hash", hexadecimal(header.hash)},
              {"bytes", header.file_bytes}});
  for (const Json& figures : {to_json(inspection.tree), work_json(inspection.work[0])})
    for (const auto& [key, value] : figures.items()) report.add(key, value);
  report.add({{"surface", inspection.surface ? surface_json(*inspection.surface) : Json()},
              {"leaf_blocks_at_depth", inspection.tree.leaf_blocks_at_depth},
              {"blocks_with_fill", inspection.tree.blocks_with_fill},
              {"bounds/lower", header.lower},
              {"bounds/upper", header.upper},
              {"origin", header.origin},
              {"rounding_error", header.rounding_error},
              {"source_faces", header.source_faces},
              {"source_vertices", header.source_vertices > 0 ? Json(header.source_vertices) : Json()},
              {"source", inspection.source},
              {"parts", parts_json(view)}});
  const Json levels = levels_json(inspection);
  report.add("levels", levels);
  report.add("sections", sections_json(view));

  add_source(inspection.source, report);
  add_parts(view, report);
  report.row("bounds", point(header.lower) + " to " + point(header.upper));
  report.row("origin", point(header.origin) + format(", rounding error %.3g", header.rounding_error));
  report.row("surface", surface_words(inspection.surface));
  report.row("refit", refit_words(header));
  add_tree(inspection.tree, report);
  add_work(view.level(), inspection.work[0], report);
  if (view.levels.size() > 1) add_level_lines(levels, report);
  add_histogram("leaf blocks at depth", inspection.tree.leaf_blocks_at_depth, 0, 1, report);
  add_histogram("blocks with so many nodes that are not imaginary", inspection.tree.blocks_with_fill, 1, 0,
                report);
  add_section_lines(view, report);
  return report;
}

std::string comparison(const std::vector<Inspection>& inspections) {
  std::vector<Json> files;
  std::string text = format("%-30s", "");
  for (const Inspection& inspection : inspections) {
    files.push_back(report_of(inspection).json());
    const std::string name = text_of(path_of(inspection.path).filename());
    text += format(" %24s", printable(name, name.size() > 24 ? 21 : 24).c_str());
  }
  text += "\n";
  for (const char* key : kCompared) {
    text += format("%-30s", key);
    const double base = files[0][key].is_null() ? 0 : files[0][key].get<double>();
    for (std::size_t i = 0; i < files.size(); ++i) {
      const std::string value = figure(files[i][key]);
      const std::string ratio = i > 0 && base != 0 && !files[i][key].is_null()
                                    ? format("x%.3f", files[i][key].get<double>() / base)
                                    : "";
      text += format(" %14s %9s", value.c_str(), ratio.c_str());
    }
    text += "\n";
  }
  return text;
}

}  // namespace tandem
