// A program of its own, because what CUB keeps of its first call stays as long as the process runs.
#include <gtest/gtest.h>

#include <vector>

#include "kernels/scene/gpu_broad_phase_fixture.h"

namespace tandem {
namespace {

using test::Boxes;
using test::kMany;

/// Has all memory of the GPU, in smaller and smaller pieces.
class WholeGpu {
 public:
  WholeGpu() {
    for (std::size_t bytes = std::size_t{1} << 34; bytes >= kLeast; bytes /= 2) {
      void* memory = nullptr;
      while (cudaMalloc(&memory, bytes) == cudaSuccess) pieces_.push_back(memory);
      static_cast<void>(cudaGetLastError());
    }
  }
  WholeGpu(const WholeGpu&) = delete;
  WholeGpu& operator=(const WholeGpu&) = delete;
  ~WholeGpu() {
    while (give_back_piece()) {
    }
  }

  /// Gives the last and smallest piece back. False: there is none.
  bool give_back_piece() {
    if (pieces_.empty()) return false;
    static_cast<void>(cudaFree(pieces_.back()));
    pieces_.pop_back();
    return true;
  }

 private:
  static constexpr std::size_t kLeast = std::size_t{1} << 14;

  std::vector<void*> pieces_;
};

// Memory comes back piece by piece, so that at some time there is room for arrays, but not yet for CUB's
// code.
TEST(FirstSort, OfAProcessThatMeetsAFullGpuSpoilsNoLaterOne) {
  if (test::no_gpu()) GTEST_SKIP() << "no GPU here";
  Boxes boxes(kMany);
  for (std::uint32_t i = 0; i < kMany; ++i) {
    const double x = i;
    boxes[i] = {{x, 0, 0}, {x + 1.5, 1, 1}};
  }
  const auto on_gpu = test::on_gpu(boxes);
  GpuBroadPhase broad_phase;
  const auto find = [&] { return broad_phase.find_pairs(on_gpu.data(), kMany, {.sorted = true}, nullptr); };
  {
    WholeGpu whole;
    bool refused = false;
    for (Status status = find(); status != Status::kOk; status = find()) {
      ASSERT_TRUE(status == Status::kOutOfGpuMemory || status == Status::kOutOfMemory)
          << cudaGetErrorString(broad_phase.cuda_error());
      refused = true;
      if (!whole.give_back_piece()) break;
    }
    EXPECT_TRUE(refused) << "the GPU was not full";
  }
  ASSERT_EQ(find(), Status::kOk) << cudaGetErrorString(broad_phase.cuda_error());
  EXPECT_EQ(broad_phase.report().found, kMany - 1);
  EXPECT_TRUE(test::same(test::stored(broad_phase), test::of_cpu(boxes)));
}

}  // namespace
}  // namespace tandem
