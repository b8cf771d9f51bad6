#include "statistics_json.h"

#include "common/number_words.h"
#include "common/printable.h"

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

std::string samples_words(const Json& samples) {
  const auto number = [&](const char* key) {
    const bool is_there = samples.is_object() && samples.contains(key) && samples[key].is_number();
    return is_there ? std::optional(samples[key].get<double>()) : std::nullopt;
  };
  const auto count = number("count"), mean = number("mean_ratio"), worst = number("worst_ratio");
  if (!count) return "unknown";
  std::string words = format("made for %.0f samples", *count);
  if (!mean || !worst) return words + "; they overlap themselves too much to be measured";
  words += format(
      "; against trees of their own it costs %.3g times as many block pairs on the mean and %.3g "
      "times at the worst",
      *mean, *worst);
  const bool is_named = samples.contains("worst") && samples["worst"].is_string();
  return is_named ? words + " (" + printable(samples["worst"].get<std::string>(), 100) + ")" : words;
}

}  // namespace tandem
