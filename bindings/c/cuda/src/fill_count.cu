#include "fill_count.h"

namespace tandem::c {
namespace {

__global__ void fill(std::uint32_t* to, std::uint32_t value) {
  *to = value;
}

}  // namespace

cudaError_t fill_count(std::uint32_t* to, std::uint32_t value, cudaStream_t stream) {
  fill<<<1, 1, 0, stream>>>(to, value);
  return cudaGetLastError();
}

}  // namespace tandem::c
