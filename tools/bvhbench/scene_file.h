#pragma once
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tandem/kernels/contact_query.h"
#include "tandem/runtime/map.h"

namespace tandem::bench {

/// A file that could not be read or written, or makes no sense; what() names it and the reason.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What a scene file holds (docs/scenes.md).
struct SceneDescription {
  std::vector<std::string> assets;  ///< .bvh paths, relative to the scene file
  std::vector<Instance> instances;
  std::optional<std::vector<ObjectPair>> pairs;  ///< without them the broad phase makes the pairs
};

/// A scene with its assets mapped and checked.
struct Scene {
  SceneDescription description;
  std::vector<MappedAsset> assets;

  std::vector<AssetView> views() const;
};

/// Throws FileError: of the scene file, or of the asset that is to blame.
Scene read_scene(const std::string& path);

/// Appears whole or not at all. Throws FileError.
void write_scene(const std::string& path, const SceneDescription& scene);

}  // namespace tandem::bench
