#include "tandem/kernels/gpu_excluded_pairs.h"

#include "tandem/formats/gpu_status.h"

namespace tandem {

Status GpuExcludedPairs::upload(const ExcludedPairs& table, cudaStream_t stream) {
  view_ = {};
  if (table.slots == nullptr) return Status::kOk;
  error_ = slots_.upload({table.slots, table.last_slot + 1}, stream);
  if (error_ == cudaSuccess) error_ = cudaStreamSynchronize(stream);
  if (error_ != cudaSuccess) return status_of(error_);
  view_ = table;
  view_.slots = slots_.data();
  return Status::kOk;
}

}  // namespace tandem
