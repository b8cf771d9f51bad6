#pragma once
#include <cstdint>

// How a broad phase on the GPU is done, by the number of boxes: docs/decisions/broad-phase.md, gpu-walk.md.
namespace tandem {

/// Up to so many boxes are tested each against each. 8,000 take 42 us numbered by chance and 27 along a
/// lattice, by a tree 56; 12,000 take 79, 40 and 60 (H100).
inline constexpr std::uint32_t kFewBoxes = 8192;

/// Up to so many instances are posed by the kernel that tests their boxes, as often as it reads them: saves
/// 1.7 us of 1,000, 1.0 of 2,000, and loses 2.2 of 4,000.
inline constexpr std::uint32_t kFewPosed = 2048;

}  // namespace tandem
