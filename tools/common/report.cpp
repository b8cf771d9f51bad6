#include "report.h"

#include <algorithm>

#include "number_words.h"

namespace tandem {
namespace {

std::string words_of(const Json& value, Unit unit) {
  switch (unit) {
    case Unit::words:
      return value.get<std::string>();
    case Unit::count:
      return with_commas(value.get<std::uint64_t>());
    case Unit::milliseconds:
      return format("%.3f", 1e3 * (value.is_object() ? value["best"] : value).get<double>());
    case Unit::decimals:
      return format("%.4f", value.get<double>());
    case Unit::length:
      return format("%.6g", value.get<double>());
    case Unit::magnitude:
      return format("%.2e", value.get<double>());
  }
  return {};
}

// Returns what follows the best of the seconds of repeats.
std::string repeats_of(const Json& times) {
  return format("  best of %zu, median %.3f", times["all"].size(), 1e3 * times["median"].get<double>());
}

}  // namespace

void Report::Added::row(const char* label, Unit unit, const std::string& remark) const {
  report_.row(label, report_.entries_[entry_].value, unit, remark);
}

void Report::row(const char* label, const Json& value, Unit unit, const std::string& remark) {
  if (value.is_null()) return;
  const std::string repeats = value.is_object() ? repeats_of(value) : "";
  rows_.push_back({label, words_of(value, unit), repeats + remark, unit == Unit::words});
}

Report::Added Report::push(Entry entry) {
  entries_.push_back(std::move(entry));
  return {*this, entries_.size() - 1};
}

Report::Added Report::operator[](const std::string& key) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.key == key; });
  return {*this, static_cast<std::size_t>(found - entries_.begin())};
}

Json Report::json() const {
  Json json;
  for (const Entry& entry : entries_) {
    if (entry.in_json) json[Json::json_pointer("/" + entry.key)] = entry.value;
  }
  return json;
}

std::string Report::text() const {
  std::size_t width = label_width_;
  for (const Row& row : rows_) width = std::max(width, row.label.size());
  std::string text;
  for (const auto& [label, value, remark, from_left] : rows_) {
    const std::size_t gap = from_left ? 0 : value_width_ - std::min(value_width_, value.size());
    if (!label.empty()) text += "  " + label + std::string(width - label.size() + 1 + gap, ' ');
    text += value + remark + "\n";
  }
  return text;
}

Json times(const Seconds& seconds) {
  if (seconds.empty()) return {};
  return {{"best", best_of(seconds)}, {"median", median_of(seconds)}, {"all", seconds}};
}

}  // namespace tandem
