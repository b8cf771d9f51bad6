#include "dynamics/pair_colours.h"

#include <array>
#include <bit>

namespace tandem::dynamics {
std::vector<std::uint32_t> find_colours(std::span<const ColouredPair> pairs, std::size_t bodies) {
  constexpr std::size_t kWords = kSharedColours / 64;
  std::vector<std::array<std::uint64_t, kWords>> taken(bodies);
  std::vector<std::uint32_t> colours(pairs.size());
  std::uint32_t own = kSharedColours;
  const auto by_low =
      sorted_by(all_below(pairs.size()), 256, [&](std::uint32_t i) { return pairs[i].order & 255; });
  for (const std::uint32_t i :
       sorted_by(by_low, kColouredOrders / 256, [&](std::uint32_t k) { return pairs[k].order >> 8; })) {
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

}  // namespace tandem::dynamics
