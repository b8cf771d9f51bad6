#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace tandem::dynamics {

/// Two bodies that contacts move, or 0 for one that they do not; and a number that orders pairs.
struct ColouredPair {
  std::uint32_t a, b;
  std::uint32_t order;
};

/// Returns a colour for each pair: no two pairs of a colour have a body in common, but for 0. Each pair has the
/// first that none of those before it, by ascending order, has left it; so the colours of an island do not depend
/// on what else there is. Few pairs have a colour of kSharedColours or above: each is alone in its colour.
/// bodies: all places are below.
std::vector<std::uint32_t> find_colours(std::span<const ColouredPair> pairs, std::size_t bodies);

inline constexpr std::uint32_t kSharedColours = 128;

}  // namespace tandem::dynamics
