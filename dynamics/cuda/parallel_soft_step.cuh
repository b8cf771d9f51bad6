#pragma once
#include "dynamics/cuda/cuda_executor.cuh"
#include "dynamics/parallel/parallel_soft_step.h"

namespace tandem::dynamics {

extern template class ParallelSoftStep<CudaExecutor>;

}  // namespace tandem::dynamics
