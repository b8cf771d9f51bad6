#pragma once
#include <string_view>

#include "read_result.h"

namespace tandem::build {

/// Reads the polygons of a PLY file that is already in memory: text, or binary in either byte order.
///
/// Result: the elements "vertex" (x, y, z of any type), "face" and "tristrips" (a list vertex_indices or
/// vertex_index of any types) in the file's order; all other elements and properties are passed over.
/// A file of points alone is ok with no faces. In a strip, the index -1 begins the next one.
/// An index that names no vertex is no error: it stays in the mesh, with a remark.
/// Errors: a header that is cut or breaks the grammar; counts that the data does not meet; lists of negative
/// length; words that are no numbers.
ReadResult read_ply(std::string_view bytes);

}  // namespace tandem::build
