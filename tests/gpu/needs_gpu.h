#pragma once
#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

namespace tandem::test {

inline bool no_gpu() {
  int count = 0;
  if (cudaGetDeviceCount(&count) == cudaSuccess && count > 0) return false;
  static_cast<void>(cudaGetLastError());
  return true;
}

/// Tests that need a GPU. Base: testing::Test or testing::TestWithParam.
template <typename Base>
class NeedsGpu : public Base {
 protected:
  void SetUp() override {
    if (no_gpu()) GTEST_SKIP() << "no GPU here";
  }
};
using GpuTest = NeedsGpu<testing::Test>;
template <typename Parameter>
using GpuTestOf = NeedsGpu<testing::TestWithParam<Parameter>>;

}  // namespace tandem::test
