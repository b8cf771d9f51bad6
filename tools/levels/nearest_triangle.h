#pragma once
#include <cstdint>

#include "levels/point_distance.h"
#include "tandem/formats/view.h"

namespace tandem::levels {

struct NearestTriangle {
  double square;  ///< of the distance, as computed
  std::uint32_t triangle;
};

/// The triangle of the level that is nearest to p, up to rounding. The search begins with the triangle
/// `hint`.
NearestTriangle nearest_triangle(const LevelView& level, const Point& p, std::uint32_t hint);

/// A number that p's distance from the level's surface is surely not below; near it where nothing is amiss
/// with float64. `hint`: a triangle that is near.
double proved_distance(const LevelView& level, const Point& p, std::uint32_t hint);

}  // namespace tandem::levels
