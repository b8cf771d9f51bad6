#include "statistics_json.h"

#include <cstdio>

namespace tandem {

Json to_json(const TreeStatistics& s) {
  return {{"triangles", s.triangles},
          {"nodes", s.nodes},
          {"leaf_nodes", s.leaf_nodes},
          {"internal_nodes", s.internal_nodes},
          {"imaginary_nodes", s.imaginary_nodes},
          {"imaginary_minimum", s.imaginary_minimum},
          {"imaginary_fraction", s.imaginary_fraction},
          {"leaf_blocks", s.leaf_blocks},
          {"internal_blocks", s.internal_blocks},
          {"partial_leaf_blocks", s.partial_leaf_blocks},
          {"depth", s.depth},
          {"leaf_fill", s.leaf_fill},
          {"sah_cost", s.sah_cost}};
}

std::string pretty(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string hexadecimal(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

std::string with_commas(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (auto i = static_cast<std::ptrdiff_t>(text.size()) - 3; i > 0; i -= 3)
    text.insert(static_cast<std::size_t>(i), ",");
  return text;
}

std::string human_bytes(std::uint64_t bytes) {
  constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  auto value = static_cast<double>(bytes);
  int unit = 0;
  while (value >= 1024 && unit < 4) {
    value /= 1024;
    ++unit;
  }
  char text[32];
  std::snprintf(text, sizeof text, unit > 0 && value < 100 ? "%.1f %s" : "%.0f %s", value, kUnits[unit]);
  return text;
}

}  // namespace tandem
