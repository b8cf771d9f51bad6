#include "kernels/variants/lane_variant_of.h"

// The variants of 8 lanes, in a file that is compiled for machines that have the instructions.
#if defined(TANDEM_HAVE_LANES) && defined(__AVX2__)
namespace tandem {

constinit const LaneVariant kAvx2 = kLaneVariantOf<8>;

}  // namespace tandem
#endif
