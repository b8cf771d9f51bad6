#pragma once
#include <compare>
#include <cstdint>

namespace tandem {

/// Two instances whose world boxes meet; a < b, or a = b for an instance and itself.
struct ObjectPair {
  std::uint32_t a, b;

  friend auto operator<=>(const ObjectPair&, const ObjectPair&) = default;
};

}  // namespace tandem
