#pragma once
#include <algorithm>
#include <cstdint>

#include "tandem/formats/box.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/broad_phase.h"
#include "tandem/kernels/pose.h"

// A scene as queries on a GPU take it: arrays in GPU memory that belong to the caller.
namespace tandem {

/// An asset as queries on the GPU take it. Owns nothing.
struct GpuAsset {
  LevelView tree;     ///< pointers into GPU memory, as DeviceAssets::level() gives them
  TreeExtent extent;  ///< of the tree
  double origin[3];
  float lower[3], upper[3];
  std::uint64_t source_faces;     ///< how many there are: contacts name faces below this number
  std::uint64_t source_vertices;  ///< how many positions the asset is deformed by
};

/// The asset that lies in GPU memory with level `level` of a file, which lies in CPU memory. on_gpu: as
/// DeviceAssets::level() gives it. Condition: level < file.levels.size().
inline GpuAsset gpu_asset(const LevelView& on_gpu, const AssetView& file, std::uint32_t level = 0) {
  GpuAsset asset = {on_gpu,
                    extent_of(file.level(level).blocks[0]),
                    {},
                    {},
                    {},
                    file.header->source_faces,
                    file.header->source_vertices};
  std::copy_n(file.header->origin, 3, asset.origin);
  std::copy_n(file.header->lower, 3, asset.lower);
  std::copy_n(file.header->upper, 3, asset.upper);
  return asset;
}

/// The bounds of an asset, which a broad phase needs, in stored coordinates, as the file's header has them.
struct AssetBounds {
  double origin[3];
  float lower[3], upper[3];
};

/// The bounds that a file's header or a GpuAsset has.
template <typename Bounded>
AssetBounds asset_bounds(const Bounded& of) {
  AssetBounds bounds = {};
  std::copy_n(of.origin, 3, bounds.origin);
  std::copy_n(of.lower, 3, bounds.lower);
  std::copy_n(of.upper, 3, bounds.upper);
  return bounds;
}

/// Asset bounds as an array in GPU memory.
struct GpuAssetBounds {
  const AssetBounds* bounds;
  std::uint32_t count;
};

/// The numbers in which positions of a deforming body may be given.
enum class PositionTypes : std::uint8_t { float32, float32_and_float64 };

/// These records, in GPU memory, hold what queries and a broad phase need to know of each asset of a list.
struct GpuAssetRecords {
  GpuAsset* assets = nullptr;
  AssetBounds* bounds = nullptr;
  std::uint32_t count = 0;
  PositionTypes positions = PositionTypes::float32;  ///< by which assets of the list may be deformed

  GpuAssetBounds bounds_of_all() const { return {bounds, count}; }
};

/// Instances as arrays in GPU memory, which a simulation may write there. Poses apply to the file's
/// coordinates.
struct GpuInstances {
  const std::uint32_t* asset;  ///< by place in the list of assets, or of their bounds
  const Pose* pose;
  std::uint32_t count;
};

/// Object pairs and their number, both in GPU memory, as a broad phase on the GPU leaves them there.
struct GpuPairs {
  const ObjectPair* pairs;
  const std::uint32_t* count;  ///< in GPU memory
  std::uint32_t capacity;      ///< room in `pairs`; where *count is more, the query is not complete
};

}  // namespace tandem
