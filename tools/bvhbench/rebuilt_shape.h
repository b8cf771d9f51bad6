#pragma once
#include <optional>
#include <vector>

#include "bvhbench/scenes/deformations.h"
#include "tandem/build/build_asset.h"

namespace tandem::bench {

/// The triangles of a shape that bends, with a tree that is built anew for positions of its source vertices,
/// with the effort that the shape's file was built with.
class RebuiltShape {
 public:
  /// Condition: level 0 of the shape has source_vertices. The view must stay.
  explicit RebuiltShape(const AssetView& shape);

  /// Builds the tree, by so many threads. Result: false where all triangles are degenerate at these
  /// positions, which the builder leaves out; there is no tree then.
  bool build(const Positions& positions, unsigned threads);

  /// The shape with its new tree. Conditions: build() returned true. Valid until the next call.
  const AssetView& view() const { return built_->asset; }

  /// Returns which triangle of the shape a triangle of the new tree is.
  std::uint32_t original(std::uint32_t triangle) const {
    return view().level().triangles[triangle].source_face();
  }

  /// This says of each triangle of the shape whether the new tree has it.
  std::vector<bool> kept() const;

 private:
  std::vector<build::TriangleIndices> triangles_;  ///< by source vertices
  std::vector<std::uint32_t> original_;            ///< of each: its number in the shape's tree
  build::BuildOptions options_;
  std::vector<build::Point> points_;
  std::optional<build::CheckedImage> built_;
};

}  // namespace tandem::bench
