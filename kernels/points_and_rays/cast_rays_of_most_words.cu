#include "kernels/points_and_rays/exact_rays.cuh"

// Compiled without fused operations.
namespace tandem::gpu {

cudaError_t cast_rays_of_most_words(const RayArgs& args, cudaStream_t stream) {
  return launch_cast<detail::kMaxWords>(args, stream);
}

cudaError_t sort_hits_of_most_words(const RayArgs& args, cudaStream_t stream) {
  return launch_sort<detail::kMaxWords>(args, stream);
}

}  // namespace tandem::gpu
