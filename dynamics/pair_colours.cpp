#include "dynamics/pair_colours.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

namespace tandem::dynamics {

std::vector<std::uint32_t> find_colours(std::span<const ColouredPair> pairs, std::size_t bodies) {
  constexpr std::size_t kWords = kSharedColours / 64;
  std::vector<std::uint32_t> order(pairs.size()), colours(pairs.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return pairs[i].order; });
  std::vector<std::array<std::uint64_t, kWords>> taken(bodies);
  std::uint32_t alone = kSharedColours;
  for (const std::uint32_t i : order) {
    const auto [a, b, unused] = pairs[i];
    std::uint32_t colour = 0;
    for (std::size_t word = 0; word < kWords; ++word) {
      const int first = std::countr_one(taken[a][word] | taken[b][word]);
      colour += static_cast<std::uint32_t>(first);
      if (first == 64) continue;
      for (const std::uint32_t body : {a, b}) {
        if (body != 0) taken[body][word] |= std::uint64_t{1} << first;
      }
      break;
    }
    colours[i] = colour < kSharedColours ? colour : alone++;
  }
  return colours;
}

}  // namespace tandem::dynamics
