#include "kernels/contact/walk.cuh"

// Exact mode alone: nvcc may fuse multiplies and adds here. The proofs of the box tests (docs/box_test.md,
// docs/oriented_box_test.md) and of the first stage (frame_test.h, frame_distance.h) allow it, and what they
// leave is decided elsewhere.
namespace tandem::gpu {

cudaError_t walk_exact(const QueryArgs& args, cudaStream_t stream) {
  if (args.walk_only) return launch_walk<InFrame<QueryMode::exact, true>>(args, stream);
  return args.near ? launch_walk<NearInFrame<QueryMode::exact>>(args, stream)
                   : launch_walk<InFrame<QueryMode::exact>>(args, stream);
}

}  // namespace tandem::gpu
