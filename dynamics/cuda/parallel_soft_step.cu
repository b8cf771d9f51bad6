#include "dynamics/cuda/parallel_soft_step.cuh"

namespace tandem::dynamics {

template class ParallelSoftStep<CudaExecutor>;

}  // namespace tandem::dynamics
