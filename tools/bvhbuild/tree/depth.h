#pragma once
#include <bit>
#include <cstdint>

#include "tandem/formats/block.h"

namespace tandem::build {

/// Whether a group of n triangles at this depth must be split evenly from here on, so that the tree ends
/// above kMaxDepth. Even splits at least halve a group, give or take the few positions to the nearest legal
/// one, at each level.
constexpr bool must_split_evenly(std::uint32_t depth, std::uint32_t n) {
  constexpr std::uint32_t kReserve = 4;
  return depth + static_cast<std::uint32_t>(std::bit_width(n)) + kReserve >= kMaxDepth;
}

}  // namespace tandem::build
