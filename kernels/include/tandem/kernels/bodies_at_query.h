#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "tandem/kernels/detail/question.h"

namespace tandem {

/// A body whose world box contains a point.
struct BodyAt {
  std::uint32_t point;  ///< its place in the list of points
  std::uint32_t body;

  friend bool operator==(const BodyAt&, const BodyAt&) = default;
};

struct BodiesAtOptions {
  std::span<const std::array<double, 3>> points;  ///< in the world
};

struct BodiesAtCounters {
  std::uint64_t points = 0;
  std::uint64_t boxes = 0;  ///< of bodies or of several, that were tested

  friend bool operator==(const BodiesAtCounters&, const BodiesAtCounters&) = default;
};

/// Finds which bodies' world boxes contain points, their borders included: those that a body at a point may
/// touch, such as what a user points at. The filter is not asked, and pairs() are none.
class BodiesAtQuery : public Answer<BodyAt, BodiesAtCounters> {
 public:
  using Options = BodiesAtOptions;

  /// rows() ascend by point, then by body. Result: kOk; kOutOfRange, where where() of the scene is the point
  /// that has a coordinate that is NaN or beyond kLargestWorldCoordinate; kBadOption where there are 2^32 - 1
  /// points or more; or kOutOfMemory.
  Status find(Scene& scene, const BodiesAtOptions& options);

 private:
  struct State;
  Status answer(SceneState& scene, const BodiesAtOptions& options);

  Kept<State> state_;
};

}  // namespace tandem
