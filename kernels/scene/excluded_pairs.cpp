#include "tandem/kernels/excluded_pairs.h"

#include <algorithm>
#include <bit>

namespace tandem {

// There are at least twice as many slots as pairs, so at least half are empty.
Status ExcludedPairTable::set(std::span<const ObjectPair> pairs) {
  view_ = {};
  slots_.clear();
  if (pairs.empty()) return Status::kOk;
  for (const ObjectPair& pair : pairs) {
    if (std::max(pair.a, pair.b) == kNoIndex) return Status::kUnknownInstance;
  }
  if (!slots_.resize(std::bit_ceil(2 * pairs.size()))) return Status::kOutOfMemory;
  std::fill_n(slots_.data(), slots_.size(), ExcludedPairs::kEmpty);
  view_ = {slots_.data(), slots_.size() - 1, 0, 0};
  for (std::size_t row = 0; row < pairs.size(); ++row) {
    const auto [a, b] = pairs[row];
    if (std::max(a, b) >= view_.instances) {
      view_.instances = std::max(a, b) + 1;
      view_.row = row;
    }
    const std::uint64_t key = ExcludedPairs::key(a, b);
    std::uint64_t slot = view_.home(key);
    while (slots_[slot] != ExcludedPairs::kEmpty && slots_[slot] != key) slot = (slot + 1) & view_.last_slot;
    slots_[slot] = key;
  }
  return Status::kOk;
}

}  // namespace tandem
