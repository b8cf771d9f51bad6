#include "dynamics/soft_passes.h"

#include "dynamics/one_lane.h"
#include "kernels/common/lane_variant.h"

namespace tandem::dynamics {

static MotionOf<OneLane> gather(const SoftMotion* of, const std::uint32_t* body, OneLane) {
  const auto& [c, s] = of[*body];
  return {{{c[0]}, {c[1]}, {c[2]}}, {{s[0]}, {s[1]}, {s[2]}}};
}
static void scatter(const MotionOf<OneLane>& from, SoftMotion* of, const std::uint32_t* body) {
  const auto& [c, s] = from;
  of[*body] = {{c.x.v, c.y.v, c.z.v, 0}, {s.x.v, s.y.v, s.z.v, 0}};
}

namespace {

constexpr SoftPasses kScalar = kSoftPassesOf<OneLane>;

// The passes of the lanes that the walk of two trees takes on this machine.
const SoftPasses* passes_of(const LaneVariant* lanes) {
#ifdef TANDEM_HAVE_LANES
  if (lanes == &kLanes4) return &kSoftLanes4;
#ifdef TANDEM_X86_LANES
  if (lanes == &kAvx2) return &kSoftAvx2;
  if (lanes == &kAvx512) return &kSoftAvx512;
#endif
#endif
  return nullptr;
}

}  // namespace

const SoftPasses* soft_passes(BlockPairVariant variant) {
  return variant == BlockPairVariant::scalar ? &kScalar : passes_of(lane_variant(variant));
}

}  // namespace tandem::dynamics
