#include "page.h"

#include <cmath>
#include <utility>

#include "common/number_words.h"
#include "levels/level_bytes.h"

namespace tandem {
namespace {

const char* name(SectionKind kind) {
  switch (kind) {
    case SectionKind::levels:
      return "levels";
    case SectionKind::blocks:
      return "blocks";
    case SectionKind::triangles:
      return "triangles";
    case SectionKind::parts:
      return "parts";
    case SectionKind::strings:
      return "strings";
    case SectionKind::provenance:
      return "provenance";
    case SectionKind::oriented_blocks:
      return "oriented_blocks";
    case SectionKind::topology:
      return "topology";
    case SectionKind::components:
      return "components";
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

/// Of the bounds of level 0.
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

}  // namespace

Json to_json(const Inspection& inspection) {
  const AssetView& view = inspection.asset.view();
  const FileHeader& header = *view.header;
  Json json = {{"file", inspection.path},
               {"version", std::to_string(header.version_major) + "." + std::to_string(header.version_minor)},
               {"hash", hexadecimal(header.hash)},
               {"bytes", header.file_bytes}};
  json.update(to_json(inspection.tree));
  json.update(work_json(inspection.work[0]));
  json["surface"] = inspection.surface ? surface_json(*inspection.surface) : Json();
  json["leaf_blocks_at_depth"] = inspection.tree.leaf_blocks_at_depth;
  json["blocks_with_fill"] = inspection.tree.blocks_with_fill;
  json["bounds"] = {{"lower", header.lower}, {"upper", header.upper}};
  json["origin"] = header.origin;
  json["rounding_error"] = header.rounding_error;
  json["source_faces"] = header.source_faces;
  json["source"] = inspection.source;
  json["parts"] = parts_json(view);
  json["levels"] = levels_json(inspection);
  json["sections"] = sections_json(view);
  return json;
}

}  // namespace tandem
