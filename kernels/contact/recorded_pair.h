#pragma once
#include "kernels/common/pair_record.h"
#include "kernels/contact/candidate.h"

#ifdef __CUDACC__
namespace tandem::gpu {

/// The posed float64 points of a triangle of an instance.
template <typename Args>
__device__ inline void pose_corners_of(const Args& args, std::uint32_t instance, const Triangle* triangles,
                                       std::uint32_t triangle, double (&out)[3][3]) {
  const PreciseCorners* const precise = args.assets[args.instances.asset[instance]].tree.precise;
  pose_corners(stored_pose(args, instance), triangles[triangle],
               precise != nullptr ? precise + triangle : nullptr, out);
}

/// The posed float64 points of two triangles of an object pair.
template <typename Args>
__device__ inline TrianglePair posed_pair(const Args& args, const PairRecord& record, std::uint32_t a,
                                          std::uint32_t b) {
  TrianglePair pair;
  pose_corners_of(args, record.instance_a, record.triangles_a, a, pair.a);
  pose_corners_of(args, record.instance_b, record.triangles_b, b, pair.b);
  return pair;
}

}  // namespace tandem::gpu
#endif
