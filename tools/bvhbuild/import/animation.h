#pragma once
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "import.h"

namespace tandem::build {

/// One animation of a file. It plays from `begin` to `end`, in seconds.
struct AnimationClip {
  std::string name;  ///< may be empty
  double begin = 0, end = 0;

  double seconds() const { return end - begin; }
};

/// A moment of an animation.
struct AnimationTime {
  std::size_t clip = 0;
  double seconds = 0;
};

struct AnimationData;

/// The motion of a mesh: nodes that move, skins and morph targets of a glTF file. It says where each source
/// vertex is at any time. Copies share their data; any number of threads may ask at once.
class Animation {
 public:
  explicit Animation(std::shared_ptr<const AnimationData> data) : data_(std::move(data)) {}

  const std::vector<AnimationClip>& clips() const;

  /// The number of source vertices: those of the mesh that was read with the animation, in the same order.
  std::size_t vertex_count() const;

  /// Sets `positions` to those of all source vertices at rest: where nodes and weights of morph targets are
  /// what the file says of them without an animation. They are in the file's coordinates.
  void rest(std::vector<Point>& positions) const;

  /// Sets `positions` to those of all source vertices at a time of a clip. A time before its begin or after
  /// its end counts as that. Every machine computes the same numbers: sums, products, quotients and square
  /// roots alone make them. Condition: time.clip < clips().size().
  void at(const AnimationTime& time, std::vector<Point>& positions) const;

 private:
  std::shared_ptr<const AnimationData> data_;
};

/// Returns `count` times that are spread evenly over all clips, one clip after the other: the middles of
/// equal shares of the whole. Where no clip takes any time, the first `count` clips, at their begins.
std::vector<AnimationTime> spread_times(const std::vector<AnimationClip>& clips, std::size_t count);

/// A mesh and its motion, or the reason why there are none.
struct AnimatedMesh {
  ReadResult read;                     ///< the mesh at rest; its points are the source vertices
  std::optional<Animation> animation;  ///< where read.ok
};

/// Reads a glTF file's mesh and animations.
///
/// Result: the mesh as import_mesh() reads it, but posed as the file says: skins and morph targets are
/// applied at rest. Errors: those of read_gltf(); a file that is no glTF or has no animation; skins, morph
/// targets and animations that contradict themselves or name what is not there. Never throws.
AnimatedMesh import_animated(const std::filesystem::path& path, const ImportOptions& options);

}  // namespace tandem::build
