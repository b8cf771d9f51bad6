#pragma once
#include "make_scene.h"

/// What the generators share.
namespace tandem::bench {

/// Adds the offset to every translation.
void move(std::vector<Instance>& instances, const Vector& offset);

/// The least n with n^power >= count.
std::uint32_t root_above(std::uint32_t count, int power);

}  // namespace tandem::bench
