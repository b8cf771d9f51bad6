#pragma once
#include <cstdint>
#include <optional>

#include "tandem/formats/view.h"

namespace tandem::build {

/// How many pairs of triangles of the view's first level meet without having a corner's position in common:
/// the surface goes through or touches itself there. None where the coordinates are too large for a query.
/// Throws std::bad_alloc.
std::optional<std::uint64_t> count_self_contacts(const AssetView& asset, std::uint32_t threads);

}  // namespace tandem::build
