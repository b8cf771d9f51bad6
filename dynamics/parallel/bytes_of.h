#pragma once
#include <cstddef>

namespace tandem::dynamics {

/// Returns the bytes that all of these hold. Each has bytes().
template <typename... Of>
std::size_t bytes_of(const Of&... of) {
  return (std::size_t{0} + ... + of.bytes());
}

}  // namespace tandem::dynamics
