#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

namespace tandem::build {

/// The number of type T that a file stores at `bytes`, which need not be aligned, in byte order `Order`.
template <class T, std::endian Order>
T load_number(const char* bytes) {
  std::array<char, sizeof(T)> raw;
  std::copy_n(bytes, sizeof(T), raw.begin());
  if constexpr (Order != std::endian::native) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

}  // namespace tandem::build
