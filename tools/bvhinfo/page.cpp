#include "page.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <string_view>

#include "common/number_words.h"
#include "common/printable.h"

namespace tandem {
namespace {

constexpr std::size_t kPartsShown = 12;

[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
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

std::string source_lines(const Inspection& inspection) {
  const Json& source = inspection.source;
  if (!source.is_object() || !source.contains("input")) return "  source       unknown\n";
  const Json& input = source["input"];
  std::string text = "  source       " + text_of(input, "file") + ", " + text_of(input, "bytes") +
                     " bytes, XXH64 " + text_of(input, "xxh64") + ", read by " + text_of(input, "reader") +
                     "\n";
  text += "  built by     " + text_of(source, "tool") + " " + text_of(source, "version");
  if (!source.contains("options")) return text + "\n";
  const Json& options = source["options"];
  text += ", imaginary nodes " + text_of(options, "imaginary") + ", effort " + text_of(options, "effort");
  const bool interrupted = options.is_object() && options.value("interrupted", Json()) == true;
  return text + (interrupted ? ", interrupted: the best tree until then\n" : "\n");
}

std::string faces_of(const Part& part) {
  if (part.face_count == 0) return "no faces";
  if (part.face_count == 1) return "face " + with_commas(part.first_face);
  return "faces " + with_commas(part.first_face) + " to " +
         with_commas(part.first_face + part.face_count - 1);
}

std::string part_lines(const AssetView& view) {
  std::string text = format("  parts        %zu\n", view.parts.size());
  for (std::size_t i = 0; i < std::min(view.parts.size(), kPartsShown); ++i) {
    const Part& part = view.parts[i];
    const std::string path = harmless(view.path_of(part));
    const std::string name = harmless(view.name_of(part));
    text += "               " + (path.empty() ? "" : path + " : ") + (name.empty() ? "(no name)" : name) +
            "  " + faces_of(part) + "\n";
  }
  if (view.parts.size() > kPartsShown)
    text += format("               and %zu more\n", view.parts.size() - kPartsShown);
  return text;
}

std::string work_lines(const LevelView& level, const ExpectedWork& work) {
  std::string text = "  query work   not sampled: the mesh overlaps itself too much, or is too large\n";
  if (work.poses != 0)
    text = format("  query work   %.1f block pairs, %.1f candidates expected near contact (%u poses)\n",
                  work.block_pairs, work.candidates, work.poses);
  if (work.oriented)
    text += format("  on a GPU     %.1f oriented block pairs, %.1f candidates\n", work.oriented->block_pairs,
                   work.oriented->candidates);
  if (level.oriented_blocks == nullptr)
    text += "  on a GPU     no exact queries: the file has no oriented blocks\n";
  return text;
}

std::string surface_line(const std::optional<SurfaceCounts>& surface) {
  if (!surface) return "  surface      no topology: contact manifolds refuse the file\n";
  std::string text = "  surface      " + with_commas(surface->vertices) + " vertices, " +
                     with_commas(surface->components) +
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
  return text + "\n";
}

std::string tree_lines(const TreeStatistics& tree) {
  std::string text = "  triangles    " + with_commas(tree.triangles) + "\n";
  text += "  nodes        " + with_commas(tree.nodes) + ": " + with_commas(tree.leaf_nodes) + " leaves, " +
          with_commas(tree.internal_nodes) + " internal, " + with_commas(tree.imaginary_nodes) +
          format(" imaginary (%.2f %%, minimum %llu)\n", 100 * tree.imaginary_fraction,
                 static_cast<unsigned long long>(tree.imaginary_minimum));
  text += "  blocks       " + with_commas(tree.leaf_blocks) + " leaf, " + with_commas(tree.internal_blocks) +
          " internal, " + with_commas(tree.partial_leaf_blocks) + " partial leaf blocks\n";
  text += format("  depth        %u blocks\n  leaf fill    %.2f %%\n  SAH cost     %.3f\n", tree.depth,
                 100 * tree.leaf_fill, tree.sah_cost);
  return text;
}

std::string bar(std::uint64_t count, std::uint64_t largest) {
  constexpr std::uint64_t kWidth = 40;
  const std::uint64_t length = largest == 0 ? 0 : (count * kWidth + largest - 1) / largest;
  return std::string(length, '#');
}

template <typename Counts>
std::string histogram(const char* title, const Counts& counts, std::size_t first, std::size_t label_offset) {
  const std::uint64_t largest = *std::max_element(std::begin(counts), std::end(counts));
  std::string text = std::string("  ") + title + "\n";
  for (std::size_t i = first; i < std::size(counts); ++i) {
    if (counts[i] == 0) continue;
    text += format("  %11zu  %12s  ", i + label_offset, with_commas(counts[i]).c_str()) +
            bar(counts[i], largest) + "\n";
  }
  return text;
}

std::string section_lines(const Json& sections) {
  std::string text = "  sections\n";
  for (const Json& section : sections) {
    text += format("  %15s  level %u  offset %12s  %12s bytes  %10s elements\n",
                   section["kind"].get<std::string>().c_str(), section["level"].get<unsigned>(),
                   with_commas(section["offset"].get<std::uint64_t>()).c_str(),
                   with_commas(section["bytes"].get<std::uint64_t>()).c_str(),
                   with_commas(section["count"].get<std::uint64_t>()).c_str());
  }
  return text;
}

/// Levels side by side.
std::string level_lines(const Json& levels) {
  std::string text =
      "  levels       triangles     blocks  depth         bytes  error bound  of diagonal  block pairs\n";
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const Json& level = levels[i];
    const Json &relative = level["error_bound_relative"], &pairs = level["expected_block_pairs"],
               &closed = level["closed"];
    text +=
        format("  %6zu %15s %10s %6u %13s  %11.5g  %11s  %11s%s\n", i,
               with_commas(level["triangles"].get<std::uint64_t>()).c_str(),
               with_commas(level["blocks"].get<std::uint64_t>()).c_str(), level["depth"].get<unsigned>(),
               with_commas(level["bytes"].get<std::uint64_t>()).c_str(), level["error_bound"].get<double>(),
               relative.is_null() ? "-" : format("%.3g %%", 100 * relative.get<double>()).c_str(),
               pairs.is_null() ? "-" : format("%.1f", pairs.get<double>()).c_str(),
               closed == true ? "  closed" : "");
  }
  return text;
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

std::string page(const Inspection& inspection) {
  const AssetView& view = inspection.asset.view();
  const FileHeader& header = *view.header;
  std::string text = harmless(inspection.path) + ": Tandem tree, format " +
                     std::to_string(header.version_major) + "." + std::to_string(header.version_minor) +
                     ", " + human_bytes(header.file_bytes) + ", hash " + hexadecimal(header.hash) + "\n";
  text += source_lines(inspection);
  text += part_lines(view);
  text += "  bounds       " + point(header.lower) + " to " + point(header.upper) + "\n";
  text += "  origin       " + point(header.origin) + format(", rounding error %.3g\n", header.rounding_error);
  text += surface_line(inspection.surface);
  text += tree_lines(inspection.tree);
  text += work_lines(view.level(), inspection.work[0]);
  if (view.levels.size() > 1) text += level_lines(to_json(inspection)["levels"]);
  text += histogram("leaf blocks at depth", inspection.tree.leaf_blocks_at_depth, 0, 1);
  text +=
      histogram("blocks with so many nodes that are not imaginary", inspection.tree.blocks_with_fill, 1, 0);
  return text + section_lines(to_json(inspection)["sections"]);
}

std::string comparison(const std::vector<Inspection>& inspections) {
  std::vector<Json> files;
  std::string text = format("%-30s", "");
  for (const Inspection& inspection : inspections) {
    files.push_back(to_json(inspection));
    const std::string name = std::filesystem::path(inspection.path).filename().string();
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
