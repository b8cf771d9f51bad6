#pragma once
#include <cstdint>

#include "kernels/manifold/triangle_meeting.h"
#include "tandem/formats/topology.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/pose.h"

namespace tandem::manifold {

/// The shape of an asset, as manifolds need it. Pointers are of the CPU or of the GPU.
struct Shape {
  const Triangle* triangles = nullptr;
  const TriangleTopology* topology = nullptr;
  const Block* blocks = nullptr;                   ///< or null: then the oriented blocks are walked
  const OrientedBlock* oriented_blocks = nullptr;  ///< looked at where there are no others
  double origin[3] = {};
  Vector3 centre;       ///< of the bounds, stored coordinates
  double diagonal = 0;  ///< of the bounds
  bool closed = false;
  std::uint32_t triangle_count = 0;
};

/// A body of a pair, posed.
struct Body {
  const Shape* shape;
  Pose pose;       ///< of stored coordinates
  Vector3 centre;  ///< of the bounds, in the world
  double reach;    ///< the largest coordinate of the posed bounds

  TANDEM_HD Body(const Shape& of, const Pose& of_file)
      : shape(&of), pose(for_stored_coordinates(of_file, of.origin)) {
    centre = posed(of.centre);
    reach =
        std::fmax(std::fmax(std::fabs(centre.x), std::fabs(centre.y)), std::fabs(centre.z)) + of.diagonal / 2;
  }

  TANDEM_HD Vector3 posed(const Vector3& x) const {
    double out[3];
    apply(pose, x.x, x.y, x.z, out);
    return {out[0], out[1], out[2]};
  }
  TANDEM_HD Vector3 posed(const Triangle::Corner& corner) const {
    return posed(Vector3{corner.position[0], corner.position[1], corner.position[2]});
  }
  TANDEM_HD Vector3 corner(std::uint32_t triangle, int k) const {
    return posed(shape->triangles[triangle].corner[k]);
  }
  TANDEM_HD WorldTriangle triangle(std::uint32_t index) const {
    WorldTriangle out;
    const Triangle stored = shape->triangles[index];  // float4 loads
    for (int k = 0; k < 3; ++k) out.corner[k] = posed(stored.corner[k]);
    const Vector3 n = cross(out.corner[1] - out.corner[0], out.corner[2] - out.corner[0]);
    const double length = norm(n);
    const double turn = is_turned(shape->topology[index].flags) ? -1 : 1;
    out.normal = (length > 1e-290 ? turn / length : 0) * n;
    return out;
  }
  /// A point in the coordinates of the asset's file. Rigid: the inverse rotation is the transposed one.
  TANDEM_HD Vector3 in_file_coordinates(const Vector3& x) const {
    const auto& r = pose.rotation;
    const Vector3 d = x - Vector3{pose.translation[0], pose.translation[1], pose.translation[2]};
    const double* o = shape->origin;
    return {(r[0][0] * d.x + r[1][0] * d.y + r[2][0] * d.z) + o[0],
            (r[0][1] * d.x + r[1][1] * d.y + r[2][1] * d.z) + o[1],
            (r[0][2] * d.x + r[1][2] * d.y + r[2][2] * d.z) + o[2]};
  }
};

struct BodyPair {
  Body a, b;

  TANDEM_HD const Body& operator[](int side) const { return side == 0 ? a : b; }
  TANDEM_HD double reach() const { return std::fmax(a.reach, b.reach); }
  /// A point that moves with the bodies, whichever of them is a.
  TANDEM_HD Vector3 middle() const { return 0.5 * (a.centre + b.centre); }
  TANDEM_HD double smaller_diagonal() const { return std::fmin(a.shape->diagonal, b.shape->diagonal); }
  /// Rounding may decide on which side of a plane points lie that are no further from it: some hundred times
  /// what rounding of posed points and of their distance amounts to.
  TANDEM_HD double tolerance() const { return 0x1p-44 * reach(); }
};

}  // namespace tandem::manifold
