#include "kernels/manifold/manifold_means.h"

#ifdef TANDEM_HAVE_LANES
namespace tandem {

const ManifoldMeans* manifold_means(BlockPairVariant variant) {
  if (variant == BlockPairVariant::scalar || block_pair_test(variant) == nullptr) return nullptr;
#ifdef TANDEM_X86_LANES
  if (variant == BlockPairVariant::avx2) return &kManifoldMeansAvx2;
  if (variant == BlockPairVariant::avx512) return &kManifoldMeansAvx512;
#endif
  return &kManifoldMeansLanes4;
}

const ManifoldMeans& best_manifold_means() {
  static const ManifoldMeans& best = [] {
    const ManifoldMeans* found = nullptr;
    for (const BlockPairVariant variant : kBlockPairVariants) {
      if (const ManifoldMeans* means = manifold_means(variant); means != nullptr) found = means;
    }
    return *found;
  }();
  return best;
}

}  // namespace tandem
#endif
