#pragma once
#include <string_view>

#include "read_result.h"

namespace tandem::build {

/// Reads the polygons of an OFF file that is already in memory: OFF, COFF, NOFF, STOFF and their mixtures,
/// text or binary; in text the keyword may be missing.
///
/// Result: points and faces in the file's order; colours, normals and texture coordinates are passed over. A
/// face may be spread over several lines; what follows its last index on that line counts as its colour.
/// An index that names no vertex is no error: it stays in the mesh, with a remark.
/// Errors: 4OFF and nOFF, which hold no points in space; counts that are not those of the data; words that
/// are no numbers.
ReadResult read_off(std::string_view bytes);

}  // namespace tandem::build
