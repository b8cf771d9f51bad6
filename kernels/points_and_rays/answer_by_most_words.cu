#include "kernels/points_and_rays/exact_answers.cuh"

// Compiled without fused operations.
namespace tandem::gpu {

template cudaError_t answer_by_words<tandem::detail::kMaxWords>(const PointArgs&, cudaStream_t);
template cudaError_t answer_by_words<tandem::detail::kMaxWords>(const RayArgs&, cudaStream_t);
template cudaError_t sort_hits_by_words<tandem::detail::kMaxWords>(const RayArgs&, cudaStream_t);

}  // namespace tandem::gpu
