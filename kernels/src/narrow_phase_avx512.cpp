#include "narrow_phase_lanes.h"

#if defined(TANDEM_HAVE_LANES) && defined(__AVX512F__)
namespace tandem {

bool narrow_phase_avx512(const PairTask& task, ContactSink& sink) {
  return PairWalk<LaneMeans<16>>(task, sink).run();
}

}  // namespace tandem
#endif
