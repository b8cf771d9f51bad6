#include "inspect.h"

#include <chrono>

namespace tandem {

namespace {

// Null where it is no JSON. What is nested deeper than any tool would write is left out: a file may bring
// brackets by the million, and everything that walks such a value does so recursively.
Json parse_provenance(std::string_view text) {
  constexpr int kDeepest = 16;
  const auto keep = [](int depth, Json::parse_event_t, const Json&) { return depth <= kDeepest; };
  Json json = Json::parse(text, keep, false);
  return json.is_discarded() ? Json() : json;
}

std::optional<SurfaceCounts> count_surface(const LevelView& level) {
  if (level.topology == nullptr) return std::nullopt;
  SurfaceCounts counts;
  counts.vertices = level.vertex_count;
  counts.components = level.component_count;
  for (std::uint32_t c = 0; c < level.component_count; ++c)
    counts.closed_components += is_closed(level.components[c]);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    const std::uint32_t flags = level.topology[t].flags;
    counts.turned_triangles += is_turned(flags);
    for (int k = 0; k < 3; ++k) {
      counts.boundary_edges += is_boundary(flags, k);
      counts.sides_at_edges_of_many += has_many_triangles(flags, k);
    }
  }
  return counts;
}

}  // namespace

Inspection inspect(const std::string& path, bool only_verify) {
  Inspection inspection;
  inspection.path = path;
  const auto start = std::chrono::steady_clock::now();
  inspection.status = inspection.asset.open(path.c_str());
  inspection.check_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (inspection.status != Status::kOk || only_verify) return inspection;
  const AssetView& view = inspection.asset.view();
  inspection.tree = measure_tree(view.level(), view.header->lower, view.header->upper);
  inspection.work = sample_expected_work(view);
  inspection.surface = count_surface(view.level());
  inspection.source = parse_provenance(view.provenance);
  return inspection;
}

std::string defect_of(const Inspection& inspection) {
  std::string text = inspection.path + ": " + explain(inspection.status) + " (" + name(inspection.status);
  if (const char* unit = subject(inspection.status); unit != nullptr) {
    text += std::string(", ") + unit + " " + std::to_string(inspection.asset.where());
  }
  return text + ")";
}

}  // namespace tandem
