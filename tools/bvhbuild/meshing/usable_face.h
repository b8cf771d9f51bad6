#pragma once
#include <cstdint>
#include <span>

#include "polygon_mesh.h"
#include "tandem/build/clean_report.h"

namespace tandem::build {

/// Whether a face can be split into triangles: its indices are in range, it has three corners or more, and
/// their coordinates are finite and at most kMaxCoordinate in magnitude. Else it is counted, under the first
/// of these that fails.
bool is_usable(std::span<const Point> points, std::span<const std::uint32_t> corners, CleanReport& report);

/// Of so many points: those that none of the corners names.
std::uint64_t count_unreferenced(std::size_t points, std::span<const std::uint32_t> corners);

}  // namespace tandem::build
