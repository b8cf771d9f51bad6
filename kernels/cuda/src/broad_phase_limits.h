#pragma once
#include <cstdint>

// How a broad phase on the GPU is done, by the number of boxes. Measured: docs/decisions.md.
namespace tandem {

/// Up to so many boxes are tested each against each.
inline constexpr std::uint32_t kFewBoxes = 8192;

/// Up to so many instances are posed by the kernel that tests their boxes, as often as it reads them.
inline constexpr std::uint32_t kFewPosed = 2048;

}  // namespace tandem
