#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "meshing.h"

namespace tandem::build {

inline constexpr std::uint64_t kSplitMixStep = 0x9e3779b97f4a7c15u;

/// A round of SplitMix64 (Steele, Lea & Flood 2014): the number that its generator draws in this state.
inline std::uint64_t split_mix(std::uint64_t state) {
  std::uint64_t x = state + kSplitMixStep;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Mixes three words into a hash whose high bits are as good as its low ones. Each round is a bijection, so
/// with two of the words fixed, different third words never collide: no value of one word can make another
/// drop out.
inline std::uint64_t hash_words(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return split_mix(split_mix(split_mix(a) + b) + c);
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

/// Calls visit(i, hash(i)) in order for all i below `count`, with the table's slots on their way from memory:
/// welding is bound by cache misses, and a batch waits for them together.
template <class Hash, class Visit>
void for_each_prefetched(std::size_t count, const IndexTable& table, const Hash& hash, const Visit& visit) {
  constexpr std::size_t kBatch = 32;
  std::array<std::uint64_t, kBatch> hashes;
  for (std::size_t first = 0; first < count; first += kBatch) {
    const std::size_t batch = std::min(kBatch, count - first);
    for (std::size_t i = 0; i < batch; ++i) table.prefetch(hashes[i] = hash(first + i));
    for (std::size_t i = 0; i < batch; ++i) visit(static_cast<std::uint32_t>(first + i), hashes[i]);
  }
}

}  // namespace tandem::build
