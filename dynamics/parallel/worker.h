#pragma once
#include <cstdint>

#ifdef __CUDACC__
#include <cooperative_groups.h>
#endif

#include "tandem/formats/platform.h"

namespace tandem::dynamics {

/// One of the workers that HostExecutor::together() or CudaExecutor::together() starts. The workers of a team
/// are its lanes, which do the same thing at the same time.
struct Worker {
  std::uint32_t team, teams;  ///< which of how many
  std::uint32_t lane, lanes;
};

/// One of the workers that HostExecutor::in_cluster() or CudaExecutor::in_cluster() starts: blocks of teams.
/// Each block has memory of its own, which the others can reach too.
struct ClusterWorker {
  std::uint32_t block, blocks;  ///< blocks: a power of two
  std::uint32_t team, teams;    ///< of the block
  std::uint32_t lane, lanes;
  char* own;  ///< of the block, aligned to 16 bytes
  std::uint32_t own_bytes;

  /// Waits until all workers have come here. What they wrote before, in own memory or elsewhere, is there for
  /// all of them afterwards.
  TANDEM_HD void meet() const {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    cooperative_groups::this_cluster().sync();
#endif
  }

  /// Returns where another block has what is here in the own memory of this one.
  template <typename T>
  TANDEM_HD T* at_block(std::uint32_t of_block, T* here) const {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    return cooperative_groups::this_cluster().map_shared_rank(here, static_cast<int>(of_block));
#else
    static_cast<void>(of_block);
    return here;
#endif
  }
};

}  // namespace tandem::dynamics
