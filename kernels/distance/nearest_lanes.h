#pragma once
#include "kernels/contact/narrow_phase_lanes.h"

#ifdef TANDEM_HAVE_LANES
#include "kernels/distance/nearest_walk.h"
#include "kernels/geometry/frame_distance.h"

// The nearest phase in vectors of 4, 8 or 16 lanes.
namespace tandem {
namespace {

/// The bounds of box_distance.h for all node pairs of a block pair, in the lanes of BlockPairLanes.
template <int kCount>
class BlockPairBounds : PosedBlockPair {
 public:
  TANDEM_INLINE BlockPairBounds(const Block& a, const Block& b, const RelativePose& pose)
      : PosedBlockPair(a, b, pose) {
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      b_on_a_[i] = box_terms::b_on_face(pose, i, half_extent_b_);
      a_on_b_[i] = box_terms::a_on_face(pose, i, half_extent_a_);
    }
  }

  /// Writes 16 bounds. Result: which of them are below the limits.
  TANDEM_INLINE PairsBelow write(float limit, float other, float* out) const {
    PairsBelow below = {0, 0};
    part<0>(limit, other, out, below);
    if constexpr (kCount <= 8) part<1>(limit, other, out, below);
    if constexpr (kCount <= 4) part<2>(limit, other, out, below), part<3>(limit, other, out, below);
    return below;
  }

 private:
  template <int kPart>
  TANDEM_INLINE void part(float limit, float other, float* out, PairsBelow& below) const {
    Lanes<kCount> d[3], radius_on_a[3], radius_on_b[3];
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      d[i] = nodes_of_b<kCount>(posed_b_[i]) - nodes_of_a<kCount, kPart>(centre_a_[i]);
      radius_on_a[i] = nodes_of_a<kCount, kPart>(half_extent_a_[i]) + nodes_of_b<kCount>(b_on_a_[i]);
      radius_on_b[i] = nodes_of_b<kCount>(half_extent_b_[i]) + nodes_of_a<kCount, kPart>(a_on_b_[i]);
    }
    const Lanes<kCount> bound = distance::box_bound(pose_, d, radius_on_a, radius_on_b);
    __builtin_memcpy(out + kCount * kPart, &bound, sizeof bound);
    below.limit |= less(bound, Lanes<kCount>{} + limit).mask() << (kCount * kPart);
    below.other |= less(bound, Lanes<kCount>{} + other).mask() << (kCount * kPart);
  }

  Lanes4 b_on_a_[3], a_on_b_[3];
};

template <int kCount>
class NearestLaneMeans {
 public:
  using Bound = float;

  explicit NearestLaneMeans(const NearestTask& task) : task_(task) {}

  float limit(double distance) const { return bound_limit(task_, distance); }
  double distance(float bound) const { return bound_distance(task_, bound); }

  TANDEM_INLINE PairsBelow bounds(const Block& a, const Block& b, float limit, float other,
                                  float* out) const {
    return BlockPairBounds<kCount>(a, b, task_.frame.b_in_a).write(limit, other, out);
  }

  // This is not inlined, so as not to crowd the bounds of boxes out of registers.
  [[gnu::noinline]] std::uint32_t far_along(const NearBatch& batch, const float (&direction)[3],
                                            double at_least) const {
    const distance::FrameDirection along = direction_of(task_, direction, at_least);
    std::uint32_t mask = 0;
    for (std::uint32_t first = 0; first < kNearBatch && first < batch.count; first += kCount) {
      Corner a[3], b[3];
      gather_corners(batch, first, a, b);
      mask |= distance::is_far_along(a, b, along).mask() << first;
    }
    return mask;
  }

  [[gnu::noinline]] void bound(const NearBatch& batch, BoundedBatch& out) const {
    const DistanceFrame& frame = task_.frame;
    for (std::uint32_t first = 0; first < kNearBatch && first < batch.count; first += kCount) {
      Corner a[3], b[3];
      gather_corners(batch, first, a, b);
      const auto interval = distance::frame_interval(a, b, frame.error);
      for (int i = 0; i < kCount; ++i) {
        out.lower[first + i] = static_cast<double>(interval.lower.v[i]) * frame.least_in_world;
        out.upper[first + i] = static_cast<double>(interval.upper.v[i]) * frame.most_in_world;
      }
      for (int k = 0; k < 3; ++k)
        __builtin_memcpy(out.along[k] + first, &interval.along.x[k], sizeof interval.along.x[k]);
    }
  }

 private:
  using Corner = tandem::frame::Point<Lanes<kCount>>;

  TANDEM_INLINE void gather_corners(const NearBatch& batch, std::uint32_t first, Corner (&a)[3],
                                    Corner (&b)[3]) const {
    for (int corner = 0; corner < 3; ++corner) {
      a[corner] = gather<kCount>(task_.a->tree.triangles, batch.a + first, corner);
      b[corner] = tandem::frame::posed(task_.frame.b_in_a,
                                       gather<kCount>(task_.b->tree.triangles, batch.b + first, corner));
    }
  }

  const NearestTask& task_;
};

}  // namespace
}  // namespace tandem
#endif
