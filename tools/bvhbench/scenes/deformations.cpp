#include "deformations.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>

namespace tandem::bench {
namespace {

const std::string kGroup = "/deformations";

// The number that a name is, without leading zeros or anything else.
std::optional<std::uint32_t> number_of(const std::string& name) {
  std::uint32_t number = 0;
  const char* const end = name.data() + name.size();
  const auto [stop, error] = std::from_chars(name.data(), end, number);
  if (error != std::errc() || stop != end || std::to_string(number) != name) return {};
  return number;
}

}  // namespace

Positions narrowed(std::vector<double> positions) {
  const auto is_single = [](double x) { return static_cast<double>(static_cast<float>(x)) == x; };
  if (!std::all_of(positions.begin(), positions.end(), is_single)) return positions;
  std::vector<float> single(positions.size());
  std::transform(positions.begin(), positions.end(), single.begin(),
                 [](double x) { return static_cast<float>(x); });
  return single;
}

Deformations::Deformations(std::string path, const LoadedScene& scene)
    : path_(std::move(path)), file_(path_), rows_(scene.shapes.size()) {
  check_names(scene);
  for (std::uint32_t shape = 0; shape < rows_.size(); ++shape) {
    const std::string name = kGroup + "/" + std::to_string(scene.shapes[shape].asset);
    if (!file_.has(name)) continue;
    rows_[shape] = {name, {scene.view(shape).header->source_vertices, 3}};
    const std::uint32_t frames = frames_of(shape);
    if (!shapes_.empty() && frames != frames_) {
      throw FileError(path_ + ": " + name + ": " + std::to_string(frames) + " frames, and " +
                      rows_[shapes_[0]].name + " has " + std::to_string(frames_));
    }
    frames_ = frames;
    shapes_.push_back(shape);
  }
}

// Refuses names of assets that are not there.
void Deformations::check_names(const LoadedScene& scene) const {
  const std::vector<std::string> names = file_.names_in(kGroup);
  if (names.empty()) throw FileError(path_ + ": " + kGroup + ": there is none");
  for (const std::string& name : names) {
    const std::optional<std::uint32_t> asset = number_of(name);
    if (!asset || *asset >= scene.assets.size())
      throw FileError(path_ + ": " + kGroup + "/" + name + ": is none of " +
                      std::to_string(scene.assets.size()) + " assets");
    if (scene.assets[*asset].view().header->source_vertices == 0)
      throw FileError(path_ + ": " + kGroup + "/" + name + ": " + scene.description.assets[*asset] + ": " +
                      explain(Status::kNoSourceVertices));
  }
}

std::uint32_t Deformations::frames_of(std::uint32_t shape) const {
  const auto& [name, row] = rows_[shape];
  const std::uint64_t frames = file_.count_rows(name, row);
  if (frames == 0 || frames > std::numeric_limits<std::uint32_t>::max())
    throw FileError(path_ + ": " + name + ": " + std::to_string(frames) + " frames");
  return static_cast<std::uint32_t>(frames);
}

Positions Deformations::read(std::uint32_t shape, std::uint32_t frame) const {
  const auto& [name, row] = rows_[shape];
  return narrowed(file_.read_f64_row(name, row, frame));
}

}  // namespace tandem::bench
