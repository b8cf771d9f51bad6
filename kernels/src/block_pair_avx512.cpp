#include "block_pair_lanes.h"

#if defined(TANDEM_HAVE_LANES) && defined(__AVX512F__)
namespace tandem {

std::uint16_t block_pair_mask_avx512(const Block& a, const Block& b, const RelativePose& b_in_a) {
  return static_cast<std::uint16_t>(BlockPairLanes<16>(a, b, b_in_a).mask());
}

}  // namespace tandem
#endif
