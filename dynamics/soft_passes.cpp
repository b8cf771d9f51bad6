#include "dynamics/soft_passes.h"

#include <cmath>

#include "kernels/common/lane_variant.h"

namespace tandem::dynamics {
namespace {

struct OneTruth {
  bool is_true;

  friend bool any(OneTruth mask) { return mask.is_true; }
};

// One float32 with the operations of Lanes.
struct OneLane {
  static constexpr int kLanes = 1;
  float v;

  friend OneLane operator+(OneLane a, OneLane b) { return {a.v + b.v}; }
  friend OneLane operator+(OneLane a, float b) { return {a.v + b}; }
  friend OneLane operator-(OneLane a, OneLane b) { return {a.v - b.v}; }
  friend OneLane operator-(OneLane a) { return {-a.v}; }
  friend OneLane operator*(OneLane a, OneLane b) { return {a.v * b.v}; }
  friend OneLane operator*(float a, OneLane b) { return {a * b.v}; }
  friend OneLane operator/(OneLane a, OneLane b) { return {a.v / b.v}; }
  friend OneTruth less(OneLane a, OneLane b) { return {a.v < b.v}; }
  friend OneLane magnitude(OneLane a) { return {std::fabs(a.v)}; }
  friend OneLane square_root(OneLane a) { return {std::sqrt(a.v)}; }
  friend OneLane select(OneTruth mask, OneLane a, OneLane b) { return mask.is_true ? a : b; }
  friend OneLane larger(OneLane a, OneLane b) { return select(less(a, b), b, a); }
  friend MotionOf<OneLane> gather(const SoftMotion* of, const std::uint32_t* body, OneLane) {
    const auto& [c, s] = of[*body];
    return {{{c[0]}, {c[1]}, {c[2]}}, {{s[0]}, {s[1]}, {s[2]}}};
  }
  friend void scatter(const MotionOf<OneLane>& from, SoftMotion* of, const std::uint32_t* body) {
    const auto& [c, s] = from;
    of[*body] = {{c.x.v, c.y.v, c.z.v, 0}, {s.x.v, s.y.v, s.z.v, 0}};
  }
};

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
