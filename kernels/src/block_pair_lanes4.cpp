#include "block_pair_lanes.h"

#ifdef TANDEM_HAVE_LANES
namespace tandem {

std::uint16_t block_pair_mask_lanes4(const Block& a, const Block& b, const RelativePose& b_in_a) {
  const BlockPairLanes<4> pair(a, b, b_in_a);
  return static_cast<std::uint16_t>(pair.part<0>() | pair.part<1>() | pair.part<2>() | pair.part<3>());
}

}  // namespace tandem
#endif
