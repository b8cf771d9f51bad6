#pragma once
#include <string_view>

#include "read_result.h"

namespace tandem::build {

/// Reads the polygons of a Wavefront OBJ file that is already in memory.
///
/// Result: the v and f statements in the file's order; texture coordinates, normals, materials, points, lines
/// and curves are passed over. Objects and groups become parts: named after the group, or the object where
/// there is no group, with the path "object/group" where there are both.
/// An index that names no vertex of the file is no error: it stays in the mesh, with a remark.
/// Errors: a coordinate or an index that is no number; a file without any v or f; a zero byte.
ReadResult read_obj(std::string_view bytes);

}  // namespace tandem::build
