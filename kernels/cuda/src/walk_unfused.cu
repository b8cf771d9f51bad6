#include "walk.cuh"

// Whatever must give the same bits as the CPU: compiled without fused operations.
namespace tandem::gpu {

cudaError_t walk_unfused(const QueryArgs& args, cudaStream_t stream) {
  return args.mode == QueryMode::boxes ? launch_walk<InFrame<QueryMode::boxes>>(args, stream)
                                       : launch_walk<InFrame<QueryMode::fast>>(args, stream);
}

cudaError_t walk_world(const QueryArgs& args, cudaStream_t stream) {
  if (args.walk_only) return launch_walk<InWorld<QueryMode::exact, true>>(args, stream);
  switch (args.mode) {
    case QueryMode::exact:
      return launch_walk<InWorld<QueryMode::exact>>(args, stream);
    case QueryMode::fast:
      return launch_walk<InWorld<QueryMode::fast>>(args, stream);
    case QueryMode::boxes:
      return launch_walk<InWorld<QueryMode::boxes>>(args, stream);
  }
  return cudaErrorInvalidValue;
}

}  // namespace tandem::gpu
