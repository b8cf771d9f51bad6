#include "command.h"

#include "scenes/make_scene_parts.h"

namespace tandem::bench {

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
