#include "kernels/common/block_pair.h"

#include "kernels/common/lane_variant.h"
#include "kernels/common/lanes.h"

#if defined(__APPLE__)
#include <sys/sysctl.h>
#endif

// Vectors of 8 and 16 lanes are compiled for x86-64 with the flags that kernels/CMakeLists.txt gives.
#if defined(TANDEM_HAVE_LANES) && defined(TANDEM_X86_LANES)
#define TANDEM_HAVE_X86_LANES 1
#endif

namespace tandem {

#ifdef TANDEM_HAVE_X86_LANES
namespace {

#if defined(__APPLE__)
// The system switches the state of AVX-512 on when it is first used, so the processor alone would say no.
bool has(const char* instructions) {
  int value = 0;
  std::size_t size = sizeof value;
  return sysctlbyname(instructions, &value, &size, nullptr, 0) == 0 && value != 0;
}

bool has_avx2() {
  return has("hw.optional.avx2_0");
}

bool has_avx512() {
  return has("hw.optional.avx512f") && has("hw.optional.avx512vl") && has("hw.optional.avx512dq") &&
         has("hw.optional.avx512bw");
}
#else
bool has_avx2() {
  return __builtin_cpu_supports("avx2") != 0;
}

bool has_avx512() {
  return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
         __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512bw") != 0;
}
#endif

}  // namespace
#endif

const LaneVariant* lane_variant(BlockPairVariant variant) {
#ifdef TANDEM_HAVE_LANES
  if (variant == BlockPairVariant::lanes4) return &kLanes4;
#endif
#ifdef TANDEM_HAVE_X86_LANES
  if (variant == BlockPairVariant::avx2 && has_avx2()) return &kAvx2;
  if (variant == BlockPairVariant::avx512 && has_avx512()) return &kAvx512;
#endif
  return nullptr;
}

BlockPairTest block_pair_test(BlockPairVariant variant) {
  return way_of(variant, block_pair_mask, &LaneVariant::block_pair_test);
}

BlockPairTest block_pair_test() {
  return best_way<BlockPairTest>(block_pair_test);
}

}  // namespace tandem
