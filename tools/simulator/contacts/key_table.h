#pragma once
#include <bit>
#include <cstdint>
#include <numeric>
#include <vector>

namespace tandem::simulation {

/// A small hash table that is emptied at no cost and keeps its memory.
class KeyTable {
 public:
  /// Empties it and makes room for `most` keys.
  void start(std::size_t most) {
    const std::size_t size = std::bit_ceil(2 * most + 1);
    if (entries_.size() < size) entries_.assign(size, {}), now_ = 0;
    mask_ = entries_.size() - 1;
    if (++now_ == 0) {  // once in 2^32 times
      for (Entry& entry : entries_) entry.stamp = 0;
      now_ = 1;
    }
  }

  /// The value of a key; `value` becomes it where the key is new. Condition: no more keys than start() says.
  std::uint32_t& at(std::uint64_t key, std::uint32_t value, bool& is_new) {
    std::uint64_t hash = key * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 32;
    for (std::size_t i = hash & mask_;; i = (i + 1) & mask_) {
      Entry& entry = entries_[i];
      is_new = entry.stamp != now_;
      if (is_new) entry = {key, value, now_};
      if (entry.key == key) return entry.value;
    }
  }

 private:
  struct Entry {
    std::uint64_t key = 0;
    std::uint32_t value = 0, stamp = 0;
  };
  std::vector<Entry> entries_;
  std::size_t mask_ = 0;
  std::uint32_t now_ = 0;
};

/// Sets of numbers that grow together; each is known by its least member.
class DisjointSets {
 public:
  void start(std::size_t size) {
    parent_.resize(size);
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t i, std::uint32_t j) {
    i = find(i), j = find(j);
    if (i < j) {
      parent_[j] = i;
    } else {
      parent_[i] = j;
    }
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace tandem::simulation
