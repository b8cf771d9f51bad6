#pragma once
#include "polygon_mesh.h"
#include "tandem/build/clean_report.h"
#include "triangle_mesh.h"

namespace tandem::build {

/// Splits the faces of a file into triangles.
///
/// Effect: takes points, corners and face_begin out of `mesh` (name, parts and remarks stay) and counts in
/// `report`.
///
/// Result: the triangles in the order of the faces. Faces with an index out of range, fewer than three
/// corners, a coordinate that is not finite or one beyond +-kMaxCoordinate are left out, each counted once,
/// under the first of these that holds.
///
/// Triangles stay as they are. In larger faces, a corner at the same place as the one before it is skipped
/// and the face counted once, and a spike (from a place to another and straight back) becomes a degenerate
/// triangle: it has no area, and the face is split as if it were not there. What remains of a face without
/// any area is degenerate too; clean() drops and counts all these. They do not make a face "not simple".
///
/// A quad is cut along the diagonal that lies inside, the shorter one if both do. A larger face is projected
/// along the main axis of its Newell normal (Newell in Sutherland, Sproull & Schumacker 1974) and
/// triangulated exactly, holes reached by bridges included. Only the face's own vertices appear, each where
/// the outline has it, and its orientation stays. An outline that crosses itself makes a fan. The same input
/// gives the same triangles.
TriangleMesh triangulate(PolygonMesh& mesh, CleanReport& report);

}  // namespace tandem::build
