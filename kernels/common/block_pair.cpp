#include "kernels/common/block_pair.h"

#include "kernels/common/lane_variant.h"
#include "kernels/common/lanes.h"

// Vectors of 8 and 16 lanes are compiled for x86-64 with the flags that kernels/CMakeLists.txt gives.
#if defined(TANDEM_HAVE_LANES) && defined(TANDEM_X86_LANES)
#define TANDEM_HAVE_X86_LANES 1
#endif

namespace tandem {
namespace {

bool has_avx2() {
#ifdef TANDEM_HAVE_X86_LANES
  return __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}

bool has_avx512() {
#ifdef TANDEM_HAVE_X86_LANES
  return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
         __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512bw") != 0;
#else
  return false;
#endif
}

}  // namespace

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
