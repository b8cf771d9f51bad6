#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bvhbench/scenes/scene_file.h"
#include "bvhbuild/import/animation.h"
#include "deform.h"
#include "tandem/build/build_asset.h"

namespace tandem::bench {

/// A body of a glTF file that moves as its animations say, by positions rounded to float32, and a copy beside
/// it: displaced by a quarter of the longest side of the bounds at rest.
class AnimatedScene {
 public:
  /// Reads the animations. asset: a .bvh file that bvhbuild made of the glTF file; empty: the same is made
  /// here, for the rest pose and seven samples of the animations. frames: how many, spread evenly over all
  /// animations. Must be called while the process has a single thread. Throws FileError.
  AnimatedScene(const std::string& path, const std::string& asset, std::uint32_t frames, unsigned threads);
  AnimatedScene(const AnimatedScene&) = delete;
  AnimatedScene& operator=(const AnimatedScene&) = delete;

  const BendingScene& scene() const { return scene_; }

  /// Returns the mesh as a scene of one asset, for errors.
  const LoadedScene& names() const { return names_; }

 private:
  AssetView asset_of(const std::string& path, const std::string& asset, unsigned threads);
  AssetView built(const std::string& path, unsigned threads);

  build::AnimatedMesh mesh_;
  std::vector<build::AnimationTime> times_;
  std::optional<build::CheckedImage> built_;
  MappedAsset mapped_;
  LoadedScene names_;
  BendingScene scene_;
};

}  // namespace tandem::bench
