#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tandem/kernels/object_pair.h"

namespace tandem::dynamics {

/// Finds an order in which a Cholesky factorisation of 6 x 6 blocks may eliminate bodies, each time one with
/// the fewest others that hang together with it (minimum degree), such as a tree of bodies from its leaves.
/// links: pairs of places of bodies, any number of times. Result: places in that order; nothing if the
/// factorisation takes more multiplications than `most`.
std::optional<std::vector<std::uint32_t>> elimination_order(std::size_t bodies,
                                                            std::span<const ObjectPair> links, double most);

}  // namespace tandem::dynamics
