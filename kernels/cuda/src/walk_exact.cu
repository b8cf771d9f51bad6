#include "walk.cuh"

// Exact mode alone: nvcc may fuse multiplies and adds here. The proofs of box tests (docs/box_test.md,
// oriented_test.h) and of the first stage (frame_test.h) allow it, and what they leave is decided elsewhere.
namespace tandem::gpu {

cudaError_t walk_exact(const QueryArgs& args, cudaStream_t stream) {
  return args.walk_only ? launch_walk<InFrame<QueryMode::exact, true>>(args, stream)
                        : launch_walk<InFrame<QueryMode::exact>>(args, stream);
}

}  // namespace tandem::gpu
