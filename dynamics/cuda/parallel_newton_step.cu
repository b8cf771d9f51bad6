#include "dynamics/cuda/parallel_newton_step.cuh"

namespace tandem::dynamics {

template class ParallelNewtonStep<CudaExecutor>;

}  // namespace tandem::dynamics
