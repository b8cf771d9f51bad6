#include "command.h"

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

CLI::Validator file_name() {
  return CLI::Validator(
      [](const std::string& text) { return text.empty() ? "a file needs a name" : std::string(); }, "");
}

}  // namespace tandem::bench
