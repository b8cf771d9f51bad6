#include "inspect.h"

#include <algorithm>
#include <chrono>

namespace tandem {

namespace {

// Returns the provenance, null where it is no JSON. What is nested deeper than any tool would write is left
// out: a file may bring brackets by the million, and everything that walks such a value does so recursively.
Json parse_provenance(std::string_view text) {
  constexpr int kDeepest = 16;
  const auto keep = [](int depth, Json::parse_event_t, const Json&) { return depth <= kDeepest; };
  Json json = Json::parse(text, keep, false);
  return json.is_discarded() ? Json() : json;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

const LevelCheck* Inspection::wrong_level() const {
  if (!level_checks) return nullptr;
  const auto wrong = std::find_if(level_checks->begin(), level_checks->end(), [](const LevelCheck& check) {
    return check.verdict != BoundVerdict::holds;
  });
  return wrong == level_checks->end() ? nullptr : &*wrong;
}

Inspection inspect(const std::string& path, InspectionDepth depth) {
  Inspection inspection;
  inspection.path = path;
  const auto start = std::chrono::steady_clock::now();
  inspection.status = inspection.asset.open(path.c_str());
  inspection.check_seconds = seconds_since(start);
  if (inspection.status != Status::kOk || depth == InspectionDepth::verify) return inspection;
  const AssetView& view = inspection.asset.view();
  if (depth == InspectionDepth::verify_levels) {
    const auto start_of_levels = std::chrono::steady_clock::now();
    inspection.level_checks = check_error_bounds(view);
    inspection.level_check_seconds = seconds_since(start_of_levels);
    return inspection;
  }
  inspection.tree = measure_tree(view.level(), view.header->lower, view.header->upper);
  for (std::uint32_t i = 0; i < view.levels.size(); ++i)
    inspection.work.push_back(sample_expected_work(view.levels_from(i, 1)));
  inspection.surface = count_surface(view.level());
  inspection.source = parse_provenance(view.provenance);
  return inspection;
}

std::string defect_of(const Inspection& inspection) {
  if (inspection.status == Status::kOk) return inspection.path + ": " + defect_of(*inspection.wrong_level());
  std::string text = inspection.path + ": " + explain(inspection.status) + " (" + name(inspection.status);
  if (const char* unit = subject(inspection.status); unit != nullptr) {
    text += std::string(", ") + unit + " " + std::to_string(inspection.asset.where());
  }
  return text + ")";
}

}  // namespace tandem
