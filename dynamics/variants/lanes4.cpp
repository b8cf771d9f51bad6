#include "dynamics/soft_passes.h"

// The passes of a soft step by 4 lanes.
#if defined(TANDEM_HAVE_LANES)
namespace tandem::dynamics {

constinit const SoftPasses kSoftLanes4 = kSoftPassesOf<Lanes<4>>;

}  // namespace tandem::dynamics
#endif
