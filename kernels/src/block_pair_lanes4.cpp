#include "block_pair_lanes.h"

#ifdef TANDEM_HAVE_LANES
namespace tandem {

std::uint16_t block_pair_mask_lanes4(const Block& a, const Block& b, const RelativePose& b_in_a) {
  return static_cast<std::uint16_t>(BlockPairLanes<4>(a, b, b_in_a).mask());
}

}  // namespace tandem
#endif
