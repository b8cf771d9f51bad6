#pragma once
#include <compare>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/excluded_pairs.h"
#include "tandem/runtime/map.h"

namespace tandem::bench {

/// A file that could not be read or written, or makes no sense; what() names it and the reason.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The notes about poses that a file has beside its scene (docs/poses.md).
struct PoseNotes {
  std::vector<std::string> geometry;  ///< of each asset: geometry_hash() in hexadecimal
  std::vector<std::string> stream;    ///< the set, "training" or "validation", and the seed
  std::vector<double> depth;          ///< of each pose, see NearContactPose
};

/// The filter of a scene file: which pairs a query is to find. Arrays have an entry for each instance, or
/// none where the file has no such dataset.
struct SceneFilter {
  std::vector<Motion> motion;
  std::vector<std::uint32_t> group, mask, world;
  std::vector<ObjectPair> excluded;

  /// Returns the filter as queries take it. `table` is made to own the excluded pairs. Throws std::bad_alloc.
  PairFilter view(ExcludedPairTable& table) const;
};

/// The contents of a scene file (docs/scenes.md).
struct SceneDescription {
  std::vector<std::string> assets;  ///< .bvh paths, relative to the scene file
  std::vector<Instance> instances;
  std::vector<std::uint32_t> level;              ///< of detail, of each instance; none: level 0 of all
  std::optional<std::vector<ObjectPair>> pairs;  ///< without them the broad phase makes the pairs
  std::optional<PoseNotes> poses;                ///< of files of poses
  SceneFilter filter;
};

/// A shape, of which instances of a scene are posed copies.
struct SceneShape {
  std::uint32_t asset;
  std::uint32_t level = 0;  ///< of detail

  friend auto operator<=>(const SceneShape&, const SceneShape&) = default;
};

/// A scene with its assets mapped and checked. Its instances are of rows of `shapes`, not of assets.
struct LoadedScene {
  SceneDescription description;
  std::vector<MappedAsset> assets;
  std::vector<SceneShape> shapes;  ///< all assets where no instance has a level; else those in use, sorted

  /// Adds an asset, and its finest level to the shapes.
  void add(MappedAsset asset);

  /// Returns the view of a shape. Its level is level 0 of the view, which has no other.
  AssetView view(std::uint32_t shape) const;
  std::vector<AssetView> views() const;

  /// The assets of the shapes, with all levels.
  std::vector<AssetView> finest_views() const;

  /// Returns the file's name of the asset of a shape.
  const std::string& name_of(std::uint64_t shape) const;
};

/// Lets the instances of a scene be of the (asset, level) pairs that `level`, of each instance, tells.
/// Condition: its instances are of assets, and these have the levels.
void use_levels(LoadedScene& scene, std::span<const std::uint32_t> level);

/// The .bvh file at a path. Throws FileError.
MappedAsset open_mesh(const std::string& path);

/// The path from here of what a file calls by its path from the file's own folder.
std::string beside(const std::string& file, const std::string& named);

/// The path of `mesh` from the scene file's folder, so that both can move together.
std::string seen_from(const std::string& scene, const std::string& mesh);

/// The file without its assets. Throws FileError.
SceneDescription read_description(const std::string& path);

/// Throws FileError: of the scene file, or of the asset that is to blame.
LoadedScene read_scene(const std::string& path);

class Hdf5Output;

/// Adds what a scene file holds to a file in the making. Throws FileError.
void add_scene(Hdf5Output& file, const SceneDescription& scene);

/// Appears whole or not at all. Throws FileError.
void write_scene(const std::string& path, const SceneDescription& scene);

}  // namespace tandem::bench
