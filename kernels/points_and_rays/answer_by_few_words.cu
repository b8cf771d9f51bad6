#include "kernels/points_and_rays/exact_answers.cuh"

// Compiled without fused operations.
namespace tandem::gpu {

template cudaError_t answer_by_words<static_cast<int>(kFewWords)>(const PointArgs&, cudaStream_t);
template cudaError_t answer_by_words<static_cast<int>(kFewWords)>(const RayArgs&, cudaStream_t);
template cudaError_t sort_hits_by_words<static_cast<int>(kFewWords)>(const RayArgs&, cudaStream_t);

}  // namespace tandem::gpu
