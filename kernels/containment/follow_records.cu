#include "kernels/containment/follow_records.h"

#include "kernels/common/follow_records.cuh"
#include "kernels/containment/containment_data.h"

namespace tandem::gpu {

cudaError_t follow_records(const GpuAsset* records, std::uint32_t count, containment::Surface* surfaces,
                           cudaStream_t stream) {
  return take_shapes_of(records, count, surfaces, stream);
}

}  // namespace tandem::gpu
