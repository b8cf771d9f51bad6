#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "hdf5_file.h"
#include "scene_file.h"

namespace tandem::bench {

/// Positions of the source vertices of an asset, x y z of each: in float32 where all are such numbers.
using Positions = std::variant<std::vector<float>, std::vector<double>>;

/// Returns these positions in float32 where nothing is lost by it.
Positions narrowed(std::vector<double> positions);

/// The deformations of a scene file (docs/scenes.md): where source vertices of its assets are, frame by
/// frame.
class Deformations {
 public:
  /// Opens the file that `scene` was read from. Throws FileError, where it has no deformations, or one that
  /// does not fit its asset or is of another number of frames.
  Deformations(std::string path, const LoadedScene& scene);

  std::uint32_t frames() const { return frames_; }

  /// The shapes of the scene that bend: those of assets that have a deformation, ascending.
  std::span<const std::uint32_t> shapes() const { return shapes_; }

  /// Reads the positions of a shape in a frame. Conditions: shape is one of shapes(), frame < frames().
  /// Throws FileError.
  Positions read(std::uint32_t shape, std::uint32_t frame) const;

 private:
  struct Row {
    std::string name;
    Shape shape;
  };

  std::uint32_t frames_of(std::uint32_t shape) const;
  void check_names(const LoadedScene& scene) const;

  std::string path_;
  Hdf5Input file_;
  std::vector<Row> rows_;  // of each shape of the scene; without a name: it does not bend
  std::vector<std::uint32_t> shapes_;
  std::uint32_t frames_ = 0;
};

}  // namespace tandem::bench
