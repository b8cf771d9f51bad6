// Tests what is said where no GPU can be used. ctest hides the GPUs, or puts a driver that is too old in the
// way (old_driver.cpp). The environment variable TANDEM_EXPECTED_STATUS has the name of the Status that is
// expected: GpuNotSupported where this program is compiled for other kinds of GPU than the one that is there.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "build/sample_asset.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/runtime/upload.h"

namespace tandem {
namespace {

class GpuAbsent : public testing::Test {
 protected:
  void SetUp() override {
    const char* name = std::getenv("TANDEM_EXPECTED_STATUS");
    if (name == nullptr) GTEST_SKIP() << "TANDEM_EXPECTED_STATUS is not set";
    expected_ = name;
  }

  /// There is a GPU with memory, but no code for it.
  bool has_memory() const { return expected_ == name(Status::kGpuNotSupported); }

  std::string expected_;
};

TEST(GpuStatus, CudasErrorsHaveNamesOfTheirOwn) {
  constexpr int kSomeDriver = 12000;
  EXPECT_EQ(status_of(cudaSuccess, kSomeDriver), Status::kOk);
  EXPECT_EQ(status_of(cudaErrorNoDevice, kSomeDriver), Status::kNoGpu);
  EXPECT_EQ(status_of(cudaErrorDevicesUnavailable, kSomeDriver), Status::kNoGpu);
  EXPECT_EQ(status_of(cudaErrorInsufficientDriver, 0), Status::kNoGpu);
  EXPECT_EQ(status_of(cudaErrorInsufficientDriver, kSomeDriver), Status::kDriverTooOld);
  EXPECT_EQ(status_of(cudaErrorUnsupportedPtxVersion, kSomeDriver), Status::kDriverTooOld);
  EXPECT_EQ(status_of(cudaErrorSystemDriverMismatch, kSomeDriver), Status::kDriverTooOld);
  EXPECT_EQ(status_of(cudaErrorNoKernelImageForDevice, kSomeDriver), Status::kGpuNotSupported);
  EXPECT_EQ(status_of(cudaErrorMemoryAllocation, kSomeDriver), Status::kOutOfGpuMemory);
  EXPECT_EQ(status_of(cudaErrorIllegalAddress, kSomeDriver), Status::kCudaFailed);
}

TEST_F(GpuAbsent, AnUploadSaysSo) {
  if (has_memory()) GTEST_SKIP() << "an upload needs no code";
  const build::Image image = test::make_file(test::random_mesh(10, 1));
  const AssetView view = check(image.data(), image.size()).asset;
  DeviceAssets assets;
  EXPECT_EQ(name(assets.upload({&view, 1}, Contents::all, nullptr)), expected_);
  EXPECT_NE(assets.cuda_error(), cudaSuccess);
  EXPECT_EQ(assets.bytes(), 0u);
}

TEST_F(GpuAbsent, ABroadPhaseSaysSo) {
  GpuBroadPhase broad;
  EXPECT_EQ(name(broad.reserve({10, 10, 10})), expected_);
  EXPECT_EQ(name(broad.find_pairs(nullptr, 10, {}, nullptr)), expected_);
  EXPECT_NE(broad.cuda_error(), cudaSuccess);
  EXPECT_EQ(broad.bytes(), 0u);
}

TEST_F(GpuAbsent, AContactQuerySaysSo) {
  GpuContactQuery query;
  EXPECT_EQ(name(query.set_assets({}, nullptr)), expected_);
  EXPECT_NE(query.cuda_error(), cudaSuccess);
  EXPECT_EQ(query.bytes(), 0u);
  if (has_memory()) return;  // what follows needs set_assets()
  EXPECT_EQ(name(query.reserve({10, 10, 10})), expected_);
  EXPECT_EQ(name(query.find_contacts({}, {}, {}, nullptr)), expected_);
}

}  // namespace
}  // namespace tandem
