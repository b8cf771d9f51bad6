#pragma once
#include <cstdint>

namespace tandem::dynamics {

/// One of the workers that HostExecutor::together() or CudaExecutor::together() starts. The workers of a team
/// are its lanes, which do the same thing at the same time.
struct Worker {
  std::uint32_t team, teams;  ///< which of how many
  std::uint32_t lane, lanes;
};

}  // namespace tandem::dynamics
