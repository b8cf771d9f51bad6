#pragma once
#include <cstdint>
#include <span>

#include "kernels/refit/refit_ways.h"
#include "tandem/formats/status.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {

/// A tree whose triangles follow the vertices of a deforming body: the blocks and triangles of a level, at
/// positions that change. Which blocks and triangles there are stays, and so do faces, parts and topology.
class DeformedTree : public Allocated {
 public:
  /// Copies what does not change. rest: a level with `source_vertices`. Result: kOk or kOutOfMemory.
  Status begin(const LevelView& rest);

  /// Moves the corners to the positions of their source vertices, three numbers each, and refits all boxes
  /// around them: each contains what is below it in real arithmetic. Takes time in proportion to the
  /// triangles. Condition: begin() has succeeded, there is a position for each source vertex, and
  /// check_positions() found nothing. Result: kOk; or kOutOfMemory, and nothing has changed.
  Status refit(std::span<const float> positions);
  Status refit(std::span<const double> positions);

  /// Takes the memory for positions in float64: refit() then takes none. Result: kOk or kOutOfMemory.
  Status provide_float64(std::size_t numbers);

  /// Refits by a way of the caller's, and returns what that returns. positions: as of refit(), or null, where
  /// the leaves' boxes stay.
  double refit_by(Refit way, const float* positions);

  /// The level, at the positions of the last refit(). Its pointers stay until begin() is called again.
  const LevelView& level() const { return level_; }

  /// How far a vertex may be from the corner that the triangles hold, along each axis: 0 where all positions
  /// are float32 numbers. It is a bound over all source vertices.
  const double (&rounding() const)[3] { return rounding_; }

  /// The surface of all inner boxes divided by that of the box around the tree, by the same of the tree that
  /// begin() was given; 1 where either has no surface.
  double looseness() const;

 private:
  void refit_leaf(Block& block, int node, const double* positions);
  double by_root(double surfaces) const;

  Buffer<Block> blocks_;
  Buffer<Triangle> triangles_;
  Buffer<PreciseCorners> precise_;  // only where vertices are float64 numbers
  Buffer<CornerSources> sources_;   // of each triangle: the source vertices of its corners
  LevelView level_;
  Buffer<float> single_;  // positions in float64 that are float32 numbers
  double rounding_[3] = {};
  double surface_ = 0, surface_at_rest_ = 0;
};

/// Returns the first of these positions, three numbers each, that is not finite or whose magnitude along an
/// axis is beyond kMaxCoordinate; or, where there is none, how many there are. lower, upper: then the bounds
/// of all.
std::size_t check_positions(std::span<const float> positions, float (&lower)[3], float (&upper)[3]);
std::size_t check_positions(std::span<const double> positions, float (&lower)[3], float (&upper)[3]);

}  // namespace tandem
