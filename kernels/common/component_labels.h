#pragma once
#include <cstdint>

#include "tandem/formats/view.h"

namespace tandem::containment {

/// Writes the label of each triangle of a level, see inside_test.h, in time linear in their number. `level`
/// has topology, all in CPU memory. False: out of memory.
[[nodiscard]] bool label_triangles(const LevelView& level, std::uint32_t* labels);

}  // namespace tandem::containment
