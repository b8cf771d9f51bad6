#pragma once
#include "dynamics/cuda/cuda_executor.cuh"
#include "dynamics/parallel/parallel_newton_step.h"

namespace tandem::dynamics {

extern template class ParallelNewtonStep<CudaExecutor>;

}  // namespace tandem::dynamics
