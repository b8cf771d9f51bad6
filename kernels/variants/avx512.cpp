#include "kernels/variants/lane_variant_of.h"

// The variants of 16 lanes, in a file that is compiled for machines that have the instructions.
#if defined(TANDEM_HAVE_LANES) && defined(__AVX512F__)
namespace tandem {

constinit const LaneVariant kAvx512 = kLaneVariantOf<16>;

}  // namespace tandem
#endif
