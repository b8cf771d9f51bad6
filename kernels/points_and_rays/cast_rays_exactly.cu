#include "kernels/points_and_rays/exact_rays.cuh"

// Compiled without fused operations.
namespace tandem::gpu {

cudaError_t cast_rays_exactly(const RayArgs& args, cudaStream_t stream) {
  if (args.probe_count == 0) return cudaSuccess;
  return args.capacity.words <= kFewWords ? launch_cast<static_cast<int>(kFewWords)>(args, stream)
                                          : cast_rays_of_most_words(args, stream);
}

cudaError_t sort_hits(const RayArgs& args, cudaStream_t stream) {
  return args.capacity.words <= kFewWords ? launch_sort<static_cast<int>(kFewWords)>(args, stream)
                                          : sort_hits_of_most_words(args, stream);
}

}  // namespace tandem::gpu
