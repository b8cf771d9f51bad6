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
