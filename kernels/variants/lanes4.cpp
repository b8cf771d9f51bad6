#include "kernels/variants/lane_variant_of.h"

// The variants of 4 lanes.
#ifdef TANDEM_HAVE_LANES
namespace tandem {

constinit const LaneVariant kLanes4 = kLaneVariantOf<4>;

}  // namespace tandem
#endif
