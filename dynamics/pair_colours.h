#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace tandem::dynamics {

/// Two bodies that contacts move, or 0 for one that they do not.
struct ColouredPair {
  std::uint32_t a, b;
  std::uint32_t order;  ///< in which pairs have their colours, below kColouredOrders
  std::uint32_t rank;   ///< of pairs of one colour, below kColouredRanks
};
inline constexpr std::uint32_t kColouredOrders = 1 << 16, kColouredRanks = 64;

/// Returns a colour for each pair: no two pairs of a colour have a body in common, but for 0. Each pair has
/// the first colour that those before it have left; so the colours of an island do not depend on what else
/// there is. A pair that finds none below kSharedColours has a colour of its own. bodies: all places are
/// below.
std::vector<std::uint32_t> find_colours(std::span<const ColouredPair> pairs, std::size_t bodies);

inline constexpr std::uint32_t kSharedColours = 128;

/// Returns the pairs by ascending colour, then rank.
std::vector<std::uint32_t> order_by_colour(std::span<const ColouredPair> pairs,
                                           std::span<const std::uint32_t> colours);

}  // namespace tandem::dynamics
