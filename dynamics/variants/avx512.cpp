#include "dynamics/soft_passes.h"

// The passes of a soft step by 16 lanes.
#if defined(TANDEM_HAVE_LANES) && defined(__AVX512F__)
namespace tandem::dynamics {

constinit const SoftPasses kSoftAvx512 = kSoftPassesOf<Lanes<16>>;

}  // namespace tandem::dynamics
#endif
