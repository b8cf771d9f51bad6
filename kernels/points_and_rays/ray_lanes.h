#pragma once
#include "kernels/common/lanes.h"
#include "kernels/points_and_rays/probe_walk.h"

// The steps before the walks of rays, by several rays at once. Included by files that are compiled for
// different machines: internal linkage, see lanes.h.
namespace tandem {
namespace {

/// Rays one by one, as a compiler without vectors has them.
struct PlainReal {
  static constexpr std::uint32_t kLanes = 1;
  using Real = double;
  static double load(const double* from) { return *from; }
  static void store(double x, double* to) { *to = x; }
  static void store(float x, float* to) { *to = x; }
  static unsigned bits_of(bool mask) { return mask; }
};

#ifdef TANDEM_HAVE_LANES

/// This has as many float64 numbers as a vector of the machine has: GCC takes wider ones apart where it
/// selects.
template <int kCount>
struct Reals {
  using Doubles = DoubleLanes<kCount>;
  Doubles v;

  Reals() = default;
  TANDEM_INLINE Reals(const Doubles& of) : v(of) {}
  TANDEM_INLINE Reals(double x) : v(Doubles{} + x) {}

  TANDEM_INLINE friend Reals operator+(const Reals& a, const Reals& b) { return a.v + b.v; }
  TANDEM_INLINE friend Reals operator-(const Reals& a, const Reals& b) { return a.v - b.v; }
  TANDEM_INLINE friend Reals operator*(const Reals& a, const Reals& b) { return a.v * b.v; }
  TANDEM_INLINE friend Reals operator/(const Reals& a, const Reals& b) { return a.v / b.v; }

  struct Mask {
    DoubleMask<kCount> bits;

    TANDEM_INLINE friend Mask operator&(const Mask& a, const Mask& b) { return {a.bits & b.bits}; }
    TANDEM_INLINE friend Mask operator|(const Mask& a, const Mask& b) { return {a.bits | b.bits}; }
    TANDEM_INLINE friend Mask operator!(const Mask& a) { return {~a.bits}; }
    TANDEM_INLINE friend Reals select(const Mask& mask, const Reals& a, const Reals& b) {
      return {mask.bits ? a.v : b.v};
    }
  };

  TANDEM_INLINE friend Mask less(const Reals& a, const Reals& b) { return {a.v < b.v}; }
  TANDEM_INLINE friend Mask at_most(const Reals& a, const Reals& b) { return {a.v <= b.v}; }
  TANDEM_INLINE friend Reals magnitude(const Reals& a) {
    return {reinterpret_cast<Doubles>(reinterpret_cast<DoubleMask<kCount>>(a.v) & 0x7FFFFFFFFFFFFFFF)};
  }
  TANDEM_INLINE friend Lanes<kCount> narrowed(const Reals& a) {
    return {__builtin_convertvector(a.v, typename Lanes<kCount>::Floats)};
  }
  TANDEM_INLINE friend Reals scale_to_one(const Reals& a) {
    const DoubleMask<kCount> exponent = reinterpret_cast<DoubleMask<kCount>>(a.v) >> 52;
    const DoubleMask<kCount> normal = exponent > 1 ? exponent : DoubleMask<kCount>{} + 1;
    return {reinterpret_cast<Doubles>((2046 - normal) << 52)};
  }
};

template <int kCount>
TANDEM_INLINE Reals<kCount> widened(const Lanes<kCount>& a) {
  return {__builtin_convertvector(a.v, DoubleLanes<kCount>)};
}

/// Rays in the lanes of a vector.
template <int kCount>
struct RealLanes {
  static constexpr std::uint32_t kLanes = kCount;
  using Real = Reals<kCount>;
  TANDEM_INLINE static Real load(const double* from) {
    Real out;
    __builtin_memcpy(&out, from, sizeof out);
    return out;
  }
  TANDEM_INLINE static void store(const Real& x, double* to) { __builtin_memcpy(to, &x, sizeof x); }
  TANDEM_INLINE static void store(const Lanes<kCount>& x, float* to) { __builtin_memcpy(to, &x, sizeof x); }
  TANDEM_INLINE static unsigned bits_of(const typename Real::Mask& mask) {
    unsigned out = 0;
    for (int i = 0; i < kCount; ++i) out |= static_cast<unsigned>(mask.bits[i] & 1) << i;
    return out;
  }
};

}  // namespace

template <int kCount>
struct SingleOf<Reals<kCount>> {
  using Type = Lanes<kCount>;
};

namespace {
#endif

template <typename Means>
WorldRayOf<typename Means::Real> ready_rays(const RayGroup& group, std::uint32_t first) {
  WorldRayOf<typename Means::Real> rays;
  for (int k = 0; k < 3; ++k) {
    rays.origin[k] = Means::load(group.origin[k] + first);
    rays.direction[k] = Means::load(group.direction[k] + first);
    rays.scaled[k] = Means::load(group.scaled[k] + first);
    rays.inverse[k] = Means::load(group.inverse[k] + first);
  }
  rays.factor = Means::load(group.factor + first);
  rays.reach = group.reach;
  return rays;
}

template <typename Means>
void make_rays_ready(RayGroup& group) {
  for (std::uint32_t first = 0; first < kRaysOfGroup; first += Means::kLanes) {
    WorldRayOf<typename Means::Real> rays;
    for (int k = 0; k < 3; ++k) {
      rays.origin[k] = Means::load(group.origin[k] + first);
      rays.direction[k] = Means::load(group.direction[k] + first);
    }
    make_ready(rays);
    for (int k = 0; k < 3; ++k) {
      Means::store(rays.scaled[k], group.scaled[k] + first);
      Means::store(rays.inverse[k], group.inverse[k] + first);
    }
    Means::store(rays.factor, group.factor + first);
  }
}

template <typename Means>
unsigned place_rays(const RayGroup& group, const WorldBox& bounds, double (&place)[3][kRaysOfGroup]) {
  using Real = typename Means::Real;
  unsigned out = 0;
  for (std::uint32_t first = 0; first < kRaysOfGroup; first += Means::kLanes) {
    const WorldRayOf<Real> rays = ready_rays<Means>(group, first);
    Real begin = 0.0, end = HUGE_VAL;
    out |= Means::bits_of(meets_box(rays, bounds.lo, bounds.hi, begin, end)) << first;
    for (int k = 0; k < 3; ++k) Means::store(rays.origin[k] + begin * rays.scaled[k], place[k] + first);
  }
  return out;
}

template <typename Means>
RayGroupReach frame_rays(const RayGroup& group, const LocalFrame& frame, LocalRayGroup& out) {
  using float64::less;
  using Real = typename Means::Real;
  RayGroupReach reach = {};
  for (std::uint32_t first = 0; first < kRaysOfGroup; first += Means::kLanes) {
    const WorldRayOf<Real> rays = ready_rays<Means>(group, first);
    CutRay<Real> cut;
    auto in_range = less(Real(0.0), Real(0.0));
    const auto meets = cut_ray(frame, rays, Real(group.reach), cut, in_range);
    LocalRayOf<Real> local;
    const auto fits = round_ray(frame, cut, local);
    reach.misses |= Means::bits_of(in_range & !meets) << first;
    reach.in_frame |= Means::bits_of(in_range & meets & fits) << first;
    for (int k = 0; k < 3; ++k) {
      Means::store(local.o[k], out.o[k] + first);
      Means::store(local.d[k], out.d[k] + first);
      Means::store(local.inverse[k], out.inverse[k] + first);
    }
    Means::store(local.slack, out.slack + first);
    Means::store(local.length, out.length + first);
    Means::store(local.edge_factor, out.edge_factor + first);
    Means::store(local.least_bound, out.least_bound + first);
    Means::store(local.start, out.start + first);
  }
  return reach;
}

template <typename Means>
constexpr RayGroupWays kRayGroupWaysOf = {make_rays_ready<Means>, place_rays<Means>, frame_rays<Means>};

}  // namespace
}  // namespace tandem
