#include "dynamics/pair_colours.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

namespace tandem::dynamics {
namespace {

// Sorts things by a key below `keys`; equal ones keep their order.
template <typename Key>
std::vector<std::uint32_t> sorted_by(std::span<const std::uint32_t> things, std::size_t keys,
                                     const Key& key) {
  std::vector<std::uint32_t> next(keys + 1), out(things.size());
  for (const std::uint32_t thing : things) ++next[key(thing) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  for (const std::uint32_t thing : things) out[next[key(thing)]++] = thing;
  return out;
}

std::vector<std::uint32_t> all_below(std::size_t count) {
  std::vector<std::uint32_t> out(count);
  std::iota(out.begin(), out.end(), 0u);
  return out;
}

}  // namespace

std::vector<std::uint32_t> find_colours(std::span<const ColouredPair> pairs, std::size_t bodies) {
  constexpr std::size_t kWords = kSharedColours / 64;
  std::vector<std::array<std::uint64_t, kWords>> taken(bodies);
  std::vector<std::uint32_t> colours(pairs.size());
  std::uint32_t own = kSharedColours;
  for (const std::uint32_t i :
       sorted_by(all_below(pairs.size()), kColouredOrders, [&](std::uint32_t k) { return pairs[k].order; })) {
    const std::uint32_t a = pairs[i].a, b = pairs[i].b;
    std::uint32_t colour = 0;
    while (colour < kSharedColours) {
      const std::uint32_t word = colour / 64;
      const int first = std::countr_one(taken[a][word] | taken[b][word]);
      colour += static_cast<std::uint32_t>(first);
      if (first == 64) continue;
      if (a != 0) taken[a][word] |= std::uint64_t{1} << first;
      if (b != 0) taken[b][word] |= std::uint64_t{1} << first;
      break;
    }
    colours[i] = colour < kSharedColours ? colour : own++;
  }
  return colours;
}

std::vector<std::uint32_t> order_by_colour(std::span<const ColouredPair> pairs,
                                           std::span<const std::uint32_t> colours) {
  if (pairs.empty()) return {};
  const std::uint32_t most = *std::ranges::max_element(colours);
  const auto by_rank =
      sorted_by(all_below(pairs.size()), kColouredRanks, [&](std::uint32_t i) { return pairs[i].rank; });
  return sorted_by(by_rank, most + 1, [&](std::uint32_t i) { return colours[i]; });
}

}  // namespace tandem::dynamics
