#pragma once
#include <cstdint>

#include "kernels/geometry/orientation.h"
#include "kernels/geometry/oriented_world_box.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/world_box.h"

/// This test decides exactly whether a point lies inside a closed posed surface: it does where a ray from it
/// crosses the surface an odd number of times. The ray from p goes along the x axis of the world.
///
/// **What crosses.** Let p' = p + (0, d, e) with infinitesimals d > 0 and e > 0, e infinitely smaller than d,
/// and look along x. An edge is no more than a point at height z of p', or passes that height at a y that is
/// a number plus a multiple of e; so p' lies on no edge. The ray from p' therefore crosses a triangle within
/// its interior or not at all, and a closed surface, each edge of which has an even number of sides, an odd
/// number of times exactly where p' is inside. p' and p are on the same side if p is not on the surface. What
/// follows decides for p' and looks at p alone:
///
///     a corner is above p'               <=>  its z > p.z
///     an edge with one end above p' is   <=>  area(lower end, upper end, p) along x > 0,
///       to the right of p'                    as 0 means that the edge is at p.y, plus a multiple of e
///     a triangle has p' in its interior  <=>  one of its two edges with one end above is to the right
///
/// Then it is not seen on edge, its plane passes p' at one x, and that is beyond p.x iff volume(triangle, p)
/// has the sign opposite to that of the normal's x: positive where the edge to the right runs upwards, as y,
/// z and x are right-handed. The volume is 0 only where p is on the triangle.
namespace tandem::containment {

/// Returns whether the ray may cross a triangle all of whose corners lie in this box: else all are above or
/// none is, all edges that pass the height are to the right or none is, or all that is crossed lies behind p.
TANDEM_HD inline bool ray_may_cross(const WorldBox& box, const double* p) {
  return box.hi[0] > p[0] && box.lo[1] <= p[1] && box.hi[1] > p[1] && box.lo[2] <= p[2] && box.hi[2] > p[2];
}

/// Returns how the ray crosses the triangle: 1 where it comes out at the front, from which the corners go
/// round against the clock, -1 where it goes in there, 0 where it does not cross. Finite coordinates.
TANDEM_HD inline int ray_crossing(const double (*t)[3], const double* p) {
  using detail::ExactSigns;
  bool within = false;
  int normal_x = 0;
  for (int k = 0; k < 3; ++k) {
    const double *from = t[k], *to = t[(k + 1) % 3];
    const bool upwards = to[2] > p[2];
    if (upwards == (from[2] > p[2])) continue;
    if (ExactSigns::area(upwards ? from : to, upwards ? to : from, p, 0) <= 0) continue;
    within = !within;
    normal_x = upwards ? 1 : -1;
  }
  return within && ExactSigns::volume(t[0], t[1], t[2], p) * normal_x < 0 ? normal_x : 0;
}

TANDEM_HD inline bool ray_crosses(const double (*t)[3], const double* p) {
  return ray_crossing(t, p) != 0;
}

/// The label of a triangle is the first triangle of its component; with this bit where that is open.
inline constexpr std::uint32_t kOfOpenComponent = std::uint32_t{1} << 31;
static_assert(kMostTopologyTriangles <= kOfOpenComponent);

/// The surface of a level of an asset, as the tests need it. Pointers are of the CPU or of the GPU.
struct Surface {
  const Triangle* triangles;
  const Block* blocks;  ///< or null: then the oriented blocks are walked
  const OrientedBlock* oriented_blocks;
  const SurfaceComponent* components;
  const std::uint32_t* labels;  ///< of the triangles; null where there is one component
  std::uint32_t triangle_count, component_count;
  bool closed;      ///< all components are
  bool any_closed;  ///< some component is
  double origin[3];
  float lower[3], upper[3];  ///< bounds, stored coordinates
  double farthest;           ///< farthest_of() the tree
};

/// A body: a surface and its pose, of stored coordinates.
struct PosedSurface {
  const Surface* surface;
  Pose pose;

  TANDEM_HD void corner(std::uint32_t triangle, int k, double* out) const {
    const float* v = surface->triangles[triangle].corner[k].position;
    apply(pose, v[0], v[1], v[2], out);
  }
  TANDEM_HD WorldBox box() const { return world_box(pose, surface->lower, surface->upper); }
};

/// The world box of a real node: it contains every posed vertex below. A stored vertex v is a float64 number
/// with c - h <= v <= c + h; so c - h and c + h rounded to float64 bound it too, as rounding is monotone.
TANDEM_HD inline WorldBox node_box(const PosedSurface& body, const Block& block, int node) {
  double lower[3], upper[3];
  for (int k = 0; k < 3; ++k) {
    const double c = block.centre[k][node], h = block.half_extent[k][node];
    lower[k] = c - h, upper[k] = c + h;
  }
  return world_box(body.pose, lower, upper);
}
TANDEM_HD inline WorldBox node_box(const PosedSurface& body, const OrientedBlock& block, int node) {
  return node_world_box(body.pose, block, node, body.surface->farthest);
}

TANDEM_HD inline bool is_real(const Block& block, int node) {
  return block.kind[node] != NodeKind::imaginary;
}
TANDEM_HD inline bool is_real(const OrientedBlock& block, int node) {
  return block.half_extent[0][node] >= 0;
}

/// Returns what lies below a node: a block, or the triangle of a leaf.
TANDEM_HD inline std::uint32_t below(const Block& block, int node) {
  return block.index[node];
}
TANDEM_HD inline std::uint32_t below(const OrientedBlock& block, int node) {
  return (block.first_below & ~OrientedBlock::kIsLeafBlock) + static_cast<std::uint32_t>(node);
}

/// Returns whether the ray may cross something below the node.
template <typename AnyBlock>
TANDEM_HD inline bool ray_may_cross(const PosedSurface& body, const AnyBlock& block, int node,
                                    const double* p) {
  return is_real(block, node) && ray_may_cross(node_box(body, block, node), p);
}

/// Returns whether the ray crosses this triangle of a body, and its component is closed.
TANDEM_HD inline bool ray_crosses(const PosedSurface& body, std::uint32_t triangle, const double* p) {
  const Surface& surface = *body.surface;
  if (surface.labels != nullptr && (surface.labels[triangle] & kOfOpenComponent) != 0) return false;
  double corner[3][3];
  for (int k = 0; k < 3; ++k) body.corner(triangle, k, corner[k]);
  return ray_crosses(corner, p);
}

}  // namespace tandem::containment
