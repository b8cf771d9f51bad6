#include "level_errors.h"

#include <charconv>
#include <cmath>
#include <optional>

#include "tandem/formats/file.h"

namespace tandem::build {
namespace {

std::optional<LevelError> parse(std::string_view word) {
  const bool of_diagonal = word.ends_with('%');
  if (of_diagonal) word.remove_suffix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  if (!std::isfinite(value) || !(value > 0)) return std::nullopt;
  return LevelError{of_diagonal ? value / 100 : value, of_diagonal};
}

}  // namespace

std::vector<LevelError> usual_level_errors() {
  return {{0.001, true}, {0.003, true}, {0.01, true}, {0.03, true}};
}

std::string parse_level_errors(const std::string& text, std::vector<LevelError>& errors) {
  errors.clear();
  if (text == "auto") {
    errors = usual_level_errors();
    return {};
  }
  double largest[2] = {};  // of lengths, of shares
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const std::optional<LevelError> error = parse(word);
    if (!error)
      return "'" + word + "' is no error of a level: auto, or positive numbers, each with % or without";
    double& before = largest[error->of_diagonal ? 1 : 0];
    if (!(error->value > before)) return "'" + word + "' is not larger than the error before: errors ascend";
    before = error->value;
    errors.push_back(*error);
    begin = end + 1;
  }
  if (errors.size() < kMaxLevels) return {};
  return std::to_string(errors.size()) + " levels: a file has room for " + std::to_string(kMaxLevels - 1) +
         " beside the finest";
}

std::string name(const LevelError& error) {
  char text[40];
  const double value = error.of_diagonal ? error.value * 100 : error.value;
  const int digits = std::snprintf(text, sizeof text, "%.6g", value);
  return std::string(text, static_cast<std::size_t>(digits)) + (error.of_diagonal ? "%" : "");
}

}  // namespace tandem::build
