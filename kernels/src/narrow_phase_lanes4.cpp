#include "narrow_phase_lanes.h"

#if defined(TANDEM_HAVE_LANES)
namespace tandem {

bool narrow_phase_lanes4(const PairTask& task, ContactSink& sink) {
  return PairWalk<LaneMeans<4>>(task, sink).run();
}

}  // namespace tandem
#endif
