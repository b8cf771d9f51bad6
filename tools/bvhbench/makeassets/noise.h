#pragma once

#include <cstdint>

namespace tandem::makeassets {

// A number in [-1, 1], the same on every machine, that depends on every bit of `key`.
[[nodiscard]] double hashed(std::uint64_t key);

// Perlin's quintic: first and second derivatives vanish at 0 and 1, so that cells join without a crease.
[[nodiscard]] double fade(double t);

}  // namespace tandem::makeassets
