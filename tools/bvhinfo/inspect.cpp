#include "inspect.h"

#include <chrono>

namespace tandem {

Inspection inspect(const std::string& path, bool only_verify) {
  Inspection inspection;
  inspection.path = path;
  const auto start = std::chrono::steady_clock::now();
  inspection.status = inspection.asset.open(path.c_str());
  inspection.check_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (inspection.status != Status::kOk || only_verify) return inspection;
  const AssetView& view = inspection.asset.view();
  inspection.tree = measure_tree(view.level(), view.header->lower, view.header->upper);
  inspection.work = sample_near_contact(view.level(), view.header->lower, view.header->upper);
  inspection.source = Json::parse(view.provenance, nullptr, false);
  if (inspection.source.is_discarded()) inspection.source = nullptr;
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
