#include "narrow_phase_lanes.h"

#if defined(TANDEM_HAVE_LANES) && defined(__AVX2__)
namespace tandem {

bool narrow_phase_avx2(const PairTask& task, ContactSink& sink) {
  return PairWalk<LaneMeans<8>>(task, sink).run();
}

}  // namespace tandem
#endif
