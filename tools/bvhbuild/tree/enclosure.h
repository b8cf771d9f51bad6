#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "tree.h"

namespace tandem::build {

/// How often a surface winds around a point, by the triangles that a ray from it crosses.
class Enclosure {
 public:
  /// component: of each triangle in leaf order. weight: of each, 1 where its corners go round against the
  /// clock as seen from outside, -1 where they go the other way, 0 where it does not count. All arguments
  /// must outlive this. Condition: the triangles that count are closed surfaces.
  Enclosure(const Geometry& geometry, const Tree& tree, std::span<const std::uint32_t> component,
            std::span<const std::int8_t> weight)
      : geometry_(geometry), tree_(tree), component_(component), weight_(weight) {}

  /// The winding number of the triangles that count around a point, those of the component `own` left out;
  /// nothing where the point is so near to a triangle, or rays to edges, that roundings would decide.
  std::optional<int> around(const std::array<float, 3>& point, std::uint32_t own) const;

 private:
  Geometry geometry_;
  const Tree& tree_;
  std::span<const std::uint32_t> component_;
  std::span<const std::int8_t> weight_;
};

}  // namespace tandem::build
