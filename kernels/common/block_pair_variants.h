#pragma once
#include <cstdint>

#include "kernels/common/lanes.h"
#include "kernels/geometry/relative_pose.h"
#include "tandem/formats/block.h"

namespace tandem {

// Each defined in a file of its own, which is compiled for machines that have the instructions.
std::uint16_t block_pair_mask_lanes4(const Block& a, const Block& b, const RelativePose& b_in_a);
std::uint16_t block_pair_mask_avx2(const Block& a, const Block& b, const RelativePose& b_in_a);
std::uint16_t block_pair_mask_avx512(const Block& a, const Block& b, const RelativePose& b_in_a);

}  // namespace tandem
