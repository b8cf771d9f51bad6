#pragma once
#include <cstdint>
#include <vector>

#include "polygon_mesh.h"

namespace tandem::build {

/// Mixes three words into a hash whose high bits are as good as its low ones (multiply and fold, as wyhash
/// does).
inline std::uint64_t hash_words(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  const auto fold = [](std::uint64_t x, std::uint64_t y) {
    const auto product = static_cast<unsigned __int128>(x) * y;
    return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
  };
  return fold(fold(a ^ 0xa0761d6478bd642fu, b ^ 0xe7037ed1a0b428dbu) ^ 0x8ebc6af09c88c6e3u,
              c ^ 0x589965cc75374cc3u);
}

/// Open addressing over indices: the things themselves stay with the caller, a slot costs four bytes.
class IndexTable {
 public:
  /// Room for `count` distinct things, at most two thirds full: 6 bytes for each.
  explicit IndexTable(std::size_t count) : slots_(count + count / 2 + 1, kNoVertex) {}

  void prefetch(std::uint64_t hash) const { __builtin_prefetch(&slots_[home(hash)]); }

  /// The index stored before for which same(index) holds, else `index`, stored now. index: not kNoVertex
  template <class Same>
  std::uint32_t find_or_insert(std::uint64_t hash, std::uint32_t index, const Same& same) {
    std::size_t slot = home(hash);
    while (slots_[slot] != kNoVertex) {
      if (same(slots_[slot])) return slots_[slot];
      if (++slot == slots_.size()) slot = 0;
    }
    return slots_[slot] = index;
  }

 private:
  /// Scales the high half of the hash to the number of slots, which need not be a power of two.
  std::size_t home(std::uint64_t hash) const {
    return static_cast<std::size_t>(((hash >> 32) * slots_.size()) >> 32);
  }

  std::vector<std::uint32_t> slots_;
};

}  // namespace tandem::build
