#pragma once
#include "tandem/formats/view.h"

namespace tandem {

/// The bytes of one level's sections in its file.
std::uint64_t bytes_of_level(const AssetView& view, std::uint32_t level);

}  // namespace tandem
