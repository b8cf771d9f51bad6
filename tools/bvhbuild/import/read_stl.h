#pragma once
#include <string_view>

#include "read_result.h"

namespace tandem::build {

/// Reads the facets of an STL file that is already in memory, binary or text.
///
/// Result: three points of their own for each facet (STL shares none), in the file's order; the normals are
/// passed over. The solids of a text file become parts; a facet with more than three vertices is a polygon.
/// The size of a file says first which kind it is, because many binary files begin with "solid".
/// Errors: fewer bytes than a binary file's count of triangles promises; text that is cut or breaks the
/// grammar.
ReadResult read_stl(std::string_view bytes);

}  // namespace tandem::build
