#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/formats/platform.h"

/// The topology of a level says which triangles share edges. Contact manifolds need it beside the triangles.
///
/// A triangle has three sides; side k runs from corner k to corner k + 1 (side 2 to corner 0). Sides between
/// the same two vertices, in either direction, are the sides of one **edge**. A side between corners of the
/// same vertex belongs to no edge. Triangles that share an edge are joined; what is joined, directly or by
/// others, is a **component**.
namespace tandem {

/// A triangle's vertices and what is known of its winding and edges. One float4 load on a GPU.
///
///     byte 0          4          8          12      16
///          | vertex 0 | vertex 1 | vertex 2 | flags |
///
/// Corners at different stored positions have different vertices. Corners at the same position (-0 is 0) have
/// the same one, unless the level has source vertices: then two vertices may lie at one position, which part
/// when the mesh bends. Vertices are numbered by first appearance, in the order of the triangles and their
/// corners.
struct alignas(16) TriangleTopology {
  std::uint32_t vertex[3];
  std::uint32_t flags;  ///< kTurned | kBoundaryEdge0 << k | kManyTriangles0 << k
};
static_assert(sizeof(TriangleTopology) == 16 && offsetof(TriangleTopology, flags) == 12);

inline constexpr std::uint32_t kTurned = 1;           ///< the winding is against the outside of the surface
inline constexpr std::uint32_t kBoundaryEdge0 = 2;    ///< << k: the edge of side k has no other side
inline constexpr std::uint32_t kManyTriangles0 = 16;  ///< << k: the edge of side k has more than two sides
inline constexpr std::uint32_t kTopologyFlags = kTurned | 7 * kBoundaryEdge0 | 7 * kManyTriangles0;

/// Returns whether corners 0, 2, 1 go round against the clock as seen from outside, instead of 0, 1, 2.
TANDEM_HD constexpr bool is_turned(std::uint32_t flags) {
  return (flags & kTurned) != 0;
}

/// Returns whether side k runs from its lower to its upper vertex, once the triangle is turned where it is
/// marked. Condition: 0 <= k < 3, here and below.
TANDEM_HD constexpr bool runs_up(const TriangleTopology& triangle, std::uint32_t k) {
  return (triangle.vertex[k] < triangle.vertex[(k + 1) % 3]) != is_turned(triangle.flags);
}

/// Returns whether no other triangle has side k's edge.
TANDEM_HD constexpr bool is_boundary(std::uint32_t flags, int k) {
  return (flags & kBoundaryEdge0 << k) != 0;
}

/// Returns whether side k's edge has more than two sides.
TANDEM_HD constexpr bool has_many_triangles(std::uint32_t flags, int k) {
  return (flags & kManyTriangles0 << k) != 0;
}

/// Triangles that edges join, and no others. Components lie in the order of their first triangles.
struct alignas(16) SurfaceComponent {
  std::uint32_t first_triangle;  ///< the lowest number of a triangle of it
  std::uint32_t triangle_count;
  std::uint32_t flags;     ///< kClosedComponent or 0
  std::uint32_t reserved;  ///< zero
};
static_assert(sizeof(SurfaceComponent) == 16 && offsetof(SurfaceComponent, flags) == 8);

/// This flag is set where each edge of the component is run along equally often in both directions once the
/// turned triangles are turned.
inline constexpr std::uint32_t kClosedComponent = 1;

TANDEM_HD constexpr bool is_closed(const SurfaceComponent& component) {
  return (component.flags & kClosedComponent) != 0;
}

/// A level of as many triangles has no topology: 32 bits number the sides, and so the vertices, of fewer.
inline constexpr std::uint32_t kMostTopologyTriangles = std::uint32_t{1} << 30;

}  // namespace tandem
