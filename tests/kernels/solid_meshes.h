#pragma once
#include <array>
#include <vector>

#include "build/sample_asset.h"

/// Meshes of bodies whose overlaps have closed forms.
namespace tandem::test {

/// A flat sheet in z = 0 of side `size`, its normals up, in cells^2 squares of two triangles.
Mesh sheet(float size, int cells);

/// The octahedron's sphere, each triangle split into four `splits` times.
Mesh sphere(double radius, int splits);

/// A closed box about the origin.
Mesh box(float x, float y, float z);

/// Makes what a counter-clockwise convex polygon of the xy plane sweeps from z = -height / 2 to height / 2.
Mesh prism(const std::vector<std::array<float, 2>>& polygon, float height);

/// A regular prism.
Mesh regular_prism(int corners, double radius, float height);

/// A prism with a sharp edge along z, at x = 0.5.
Mesh wedge();

/// A regular tetrahedron, its corners at (+-0.5, +-0.5, +-0.5).
Mesh tetrahedron();

/// A pipe about the z axis, of regular polygons.
Mesh pipe(int corners, double inner_radius, double outer_radius, float height);

/// A ring about the z axis: a tube of regular polygons around a regular polygon of this radius.
Mesh ring(int corners, double radius, int tube_corners, double tube_radius);

/// A flat spring about the z axis: a rectangle that is turned and rises by its pitch with each turn.
Mesh spring(int corners, int turns, double inner_radius, double outer_radius, double pitch, double height);

/// A cup that stands on z = 0.
Mesh cup(int sectors, float radius, float height, float wall);

/// A profile of (distance from the axis, z) that is turned about the z axis: from the axis, outside first, to
/// the axis.
Mesh revolved(const std::vector<std::array<float, 2>>& profile, int sectors);

/// Both meshes in one.
Mesh joined(const Mesh& a, const Mesh& b);
Mesh moved(Mesh mesh, float x, float y, float z);

/// One of the project's own meshes.
Mesh project_mesh(const char* name);

}  // namespace tandem::test
