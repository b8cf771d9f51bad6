#include "command.h"

#include <filesystem>

#include "make_scene_parts.h"

namespace tandem::bench {

CLI::Validator between(double lower, double upper) {
  const auto defect = [lower, upper](const std::string& text) {
    double value = 0;
    if (CLI::detail::lexical_cast(text, value) && value >= lower && value <= upper) return std::string();
    return text + " is no number from " + CLI::detail::to_string(lower) + " to " +
           CLI::detail::to_string(upper);
  };
  return CLI::Validator(defect, "");
}

void keep_inputs(const std::string& output, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code missing;  // then nothing can be overwritten
    if (std::filesystem::equivalent(output, input, missing)) {
      throw UsageError(output + ": would be overwritten, and is read too");
    }
  }
}

CLI::Validator file_name() {
  return CLI::Validator(
      [](const std::string& text) { return text.empty() ? "a file needs a name" : std::string(); }, "");
}

CLI::Validator cube_of_a_whole_number() {
  const auto defect = [](const std::string& text) -> std::string {
    std::uint32_t count = 0;
    if (!CLI::detail::lexical_cast(text, count)) return {};  // told by its type
    const std::uint32_t side = root_above(count, 3);
    if (side * side * side == count) return {};
    return text + " is no cube of a whole number; " + std::to_string((side - 1) * (side - 1) * (side - 1)) +
           " and " + std::to_string(side * side * side) + " are";
  };
  return CLI::Validator(defect, "");
}

}  // namespace tandem::bench
