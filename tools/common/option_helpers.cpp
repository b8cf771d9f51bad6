#include "option_helpers.h"

#include <filesystem>

namespace tandem {

CLI::Validator between(double lower, double upper) {
  const auto defect = [lower, upper](const std::string& text) {
    double value = 0;
    if (CLI::detail::lexical_cast(text, value) && value >= lower && value <= upper) return std::string();
    return text + " is no number from " + CLI::detail::to_string(lower) + " to " +
           CLI::detail::to_string(upper);
  };
  return CLI::Validator(defect, "");
}

CLI::Validator file_name() {
  return CLI::Validator(
      [](const std::string& text) { return text.empty() ? "a file needs a name" : std::string(); }, "");
}

void keep_inputs(const std::string& output, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code missing;  // then nothing can be overwritten
    if (std::filesystem::equivalent(output, input, missing)) {
      throw UsageError(output + ": would be overwritten, and is read too");
    }
  }
}

}  // namespace tandem
