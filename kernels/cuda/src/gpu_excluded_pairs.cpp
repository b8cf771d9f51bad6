#include "tandem/kernels/gpu_excluded_pairs.h"

#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/excluded_pairs.h"

namespace tandem {

Status GpuExcludedPairs::upload(std::span<const ObjectPair> pairs, cudaStream_t stream) {
  view_ = {};
  ExcludedPairTable table;
  if (const Status status = table.set(pairs); status != Status::kOk) return status;
  error_ = slots_.upload(table.slots(), stream);
  if (error_ == cudaSuccess) error_ = cudaStreamSynchronize(stream);
  if (error_ != cudaSuccess) return status_of(error_);
  view_ = table.view();
  view_.slots = pairs.empty() ? nullptr : slots_.data();
  return Status::kOk;
}

}  // namespace tandem
