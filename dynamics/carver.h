#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "tandem/formats/platform.h"

namespace tandem::dynamics {

/// Hands out one piece of memory, array behind array. Without memory it only counts:
/// arrays then have their size and are nowhere.
class Carver {
 public:
  static constexpr std::size_t kAlignment = 16;

  /// memory: aligned, and not looked at before something is written there; or null.
  TANDEM_HD explicit Carver(std::byte* memory) : memory_(memory) {}

  template <typename T>
  TANDEM_HD void take(std::size_t count, std::span<T>& array) {
    static_assert(alignof(T) <= kAlignment);
    array = {memory_ != nullptr ? reinterpret_cast<T*>(memory_ + bytes_) : nullptr, count};
    bytes_ += (count * sizeof(T) + kAlignment - 1) / kAlignment * kAlignment;
  }

  /// Returns how much has been handed out.
  TANDEM_HD std::size_t bytes() const { return bytes_; }

 private:
  std::byte* memory_;
  std::size_t bytes_ = 0;
};

}  // namespace tandem::dynamics
