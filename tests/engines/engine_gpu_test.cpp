#include <cuda_runtime_api.h>

#include "engine_contract.h"

namespace tandem::test {

std::string why_not(std::string_view) {
  int count = 0;
  return cudaGetDeviceCount(&count) != cudaSuccess || count == 0 ? "no GPU" : "";
}

INSTANTIATE_TEST_SUITE_P(OnGpu, EngineContract, testing::Values("tandem-cuda", "paper", "paper-bits"),
                         name_of);

}  // namespace tandem::test
