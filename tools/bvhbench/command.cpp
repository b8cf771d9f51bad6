#include "command.h"

#include <filesystem>

#include "bvhbench/scenes/make_scene_parts.h"

namespace tandem::bench {

void refuse(const std::string& scene, Status status, std::uint64_t where) {
  const char* unit = subject(status);
  const std::string blamed = unit == nullptr ? "" : std::string(unit) + " " + std::to_string(where) + ": ";
  const std::string text = scene + ": " + blamed + explain(status);
  if (status == Status::kCannotStartThread) throw std::runtime_error(text);
  throw FileError(text);
}

std::vector<std::string> files_of(const std::string& path, const LoadedScene& scene) {
  std::vector<std::string> files = {path};
  for (const std::string& asset : scene.description.assets) {
    files.push_back((std::filesystem::path(path).parent_path() / asset).string());
  }
  return files;
}

std::uint64_t triangles_of(const LoadedScene& scene) {
  std::uint64_t triangles = 0;
  for (const Instance& instance : scene.description.instances) {
    triangles += scene.view(instance.asset).level().triangle_count;
  }
  return triangles;
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
