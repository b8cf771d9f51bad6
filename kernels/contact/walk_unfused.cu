#include "kernels/contact/walk.cuh"

// Modes whose answer must have the CPU's bits: compiled without fused operations.
namespace tandem::gpu {

cudaError_t walk_unfused(const QueryArgs& args, cudaStream_t stream) {
  if (args.mode == QueryMode::boxes) return launch_walk<InFrame<QueryMode::boxes>>(args, stream);
  return args.near ? launch_walk<NearInFrame<QueryMode::fast>>(args, stream)
                   : launch_walk<InFrame<QueryMode::fast>>(args, stream);
}

}  // namespace tandem::gpu
