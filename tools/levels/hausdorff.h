#pragma once
#include <cstdint>
#include <limits>
#include <optional>

#include "tandem/formats/view.h"

namespace tandem {

struct HausdorffOptions {
  /// The bounds are narrowed until upper <= lower (1 + relative), or until they differ by 2^-36 of the
  /// largest coordinate, far less than the rounding of coordinates.
  double relative = 0.002;
  /// Ends as soon as upper <= wanted is proved, or a distance above `wanted` is found; upper is infinite
  /// then. Where `wanted` itself is between bounds that are that narrow, neither may come of it.
  std::optional<double> wanted = {};
  /// Pieces of triangles that are looked into at most, or about so many; where they run out the bounds stay
  /// wide, but hold, as they do where 2^20 pieces and two for each triangle wait, for their memory. Without
  /// it: 2^20 and 64 for each triangle of both surfaces.
  std::optional<std::uint64_t> most_pieces = {};
  /// The search ends too when it has looked into so many blocks of trees for nearest triangles. Ordinary
  /// surfaces take 10 to 80 for each triangle, fans thousands. Without it: 2^20 and 1,024 for each triangle
  /// of both surfaces. bvhbuild sets less, so that others can prove its bound with other trees.
  std::optional<std::uint64_t> most_looks = {};
};

/// lower <= the Hausdorff distance of two surfaces <= upper: the largest distance of a point of either from
/// the other surface, in real arithmetic.
struct HausdorffBound {
  double upper = std::numeric_limits<double>::infinity();
  double lower = 0;      ///< a distance that occurs, rounded down
  bool narrow = true;    ///< as narrow as asked for or, given `wanted`, decided
  double point[3] = {};  ///< on one surface, up to rounding, and as far as `lower` from the other
  bool point_on_a = true;
  std::uint64_t pieces = 0;  ///< that were looked into
  std::uint64_t looks = 0;   ///< into blocks of trees
};

/// Bounds the distance of two levels in the stored coordinates of one file. The surfaces are the unions of
/// their closed triangles, of which any may be flat. The result does not depend on the number of threads.
/// Conditions: levels of fully checked files (CheckDepth::full: trees and numbers of vertices are relied on)
/// with at least one triangle each. Throws std::bad_alloc. The proof is
/// in docs/level_error.md.
HausdorffBound hausdorff_bound(const LevelView& a, const LevelView& b, const HausdorffOptions& options = {});

}  // namespace tandem
