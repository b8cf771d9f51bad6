#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/json.h"
#include "levels/hausdorff.h"

namespace tandem {

enum class BoundVerdict : std::uint8_t {
  holds,
  too_small,   ///< a point is farther away
  not_proved,  ///< neither was shown
};

/// A level's stored error bound against its distance from level 0.
struct LevelCheck {
  std::uint32_t level;
  std::uint32_t triangles;
  double error_bound;  ///< as stored
  HausdorffBound found;
  BoundVerdict verdict;
};

/// Computes the distances of all levels but level 0 anew. Condition: a checked asset.
std::vector<LevelCheck> check_error_bounds(const AssetView& asset);

/// "the error bound of level 2, 0.1, is too small: a point is 0.2 away from the other surface
/// (ErrorBoundTooSmall, level 2)". Condition: the bound does not hold.
std::string defect_of(const LevelCheck& check);

/// "level 2: 800 triangles, error bound 0.3, distance 0.29 to 0.3".
std::string line_of(const LevelCheck& check);

/// "Ok", "ErrorBoundTooSmall" or "ErrorBoundNotProved".
const char* name(BoundVerdict verdict);

/// Keys in docs/json.md.
Json to_json(const LevelCheck& check);

}  // namespace tandem
