#include "dynamics/soft_passes.h"

// The passes of a soft step by 8 lanes.
#if defined(TANDEM_HAVE_LANES) && defined(__AVX2__)
namespace tandem::dynamics {

constinit const SoftPasses kSoftAvx2 = kSoftPassesOf<Lanes<8>>;

}  // namespace tandem::dynamics
#endif
