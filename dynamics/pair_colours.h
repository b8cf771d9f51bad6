#pragma once
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "tandem/formats/platform.h"

namespace tandem::dynamics {

/// Two bodies that contacts move, or 0 for one that they do not.
struct ColouredPair {
  std::uint32_t a, b;
  std::uint32_t order;  ///< in which pairs have their colours, below kColouredOrders
};
inline constexpr std::uint32_t kColouredOrders = 1 << 16;

/// Returns the order of a pair of bodies by their places in the list of a step, or 0 for one that contacts do
/// not move. It looks like chance.
TANDEM_HD inline std::uint32_t colouring_order(std::uint32_t a, std::uint32_t b) {
  std::uint64_t x = (std::uint64_t{a} << 32 | b) + 0x9E3779B97F4A7C15u;
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return static_cast<std::uint32_t>(x >> 32) % kColouredOrders;
}

/// Returns a colour for each pair: no two pairs of a colour have a body in common, but for 0. Each pair has
/// the first colour that those before it have left; so the colours of an island do not depend on what else
/// there is. A pair that finds none below kSharedColours has a colour of its own. bodies: all places are
/// below.
std::vector<std::uint32_t> find_colours(std::span<const ColouredPair> pairs, std::size_t bodies);

inline constexpr std::uint32_t kSharedColours = 128;

/// Returns the things by ascending key, each below `keys`; equal ones keep their order.
template <typename Key>
std::vector<std::uint32_t> sorted_by(std::span<const std::uint32_t> things, std::size_t keys,
                                     const Key& key) {
  std::vector<std::uint32_t> next(keys + 1), out(things.size());
  for (const std::uint32_t thing : things) ++next[key(thing) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  for (const std::uint32_t thing : things) out[next[key(thing)]++] = thing;
  return out;
}

/// Returns 0, 1, ... below count.
inline std::vector<std::uint32_t> all_below(std::size_t count) {
  std::vector<std::uint32_t> out(count);
  std::iota(out.begin(), out.end(), 0u);
  return out;
}

}  // namespace tandem::dynamics
