#pragma once
#include <cstdint>

#include "tandem/formats/block.h"

/// Contact manifolds: what a solver takes (docs/contacts.md).
namespace tandem {

/// The most points of a manifold.
inline constexpr std::uint32_t kMostManifoldPoints = 7;

/// A point in which two bodies push against each other.
struct ManifoldPoint {
  double position[3];       ///< world, half-way between the surfaces
  double in_a[3], in_b[3];  ///< the point on the surface of a, of b, in the coordinates of its asset's file
  double
      normal[3];  ///< unit, from a towards b: the manifold's, or where the patch is bent the surfaces' here;
                  ///< of one that goes round an axis it may be at more than 90 degrees to the manifold's
  double depth;   ///< >= 0, overlap along the point's normal
  std::uint64_t id;              ///< never 0; the same in successive steps for what is the same contact
  std::uint32_t face_a, face_b;  ///< of the source files, where the point was found
  std::uint32_t previous;        ///< the same point among the points of the step before, or kNoIndex
  std::uint32_t manifold;        ///< that it belongs to
};
static_assert(sizeof(ManifoldPoint) == 128);

/// Says how the surfaces of a manifold meet.
enum ManifoldFlags : std::uint32_t {
  kTouching = 1,     ///< without overlap: depth 0
  kOpenCurve = 2,    ///< the curve in which the surfaces cross does not close: an open mesh, or mode fast
  kGoesThrough = 4,  ///< one body goes through the other here
  kAmbiguous = 8,  ///< corner on corner or edge along edge: the bodies touch, but no direction is better than
                   ///< another. The normal is 0, and there are no points
};

/// A connected region in which the surfaces of two bodies meet.
struct Manifold {
  double normal[3];  ///< unit, from a towards b: moving b along it separates the bodies; or 0 (kAmbiguous)
  double area_vector[3];  ///< of a's surface inside b, bounded by the curve in which the surfaces cross
  double centre[3];       ///< of that area, in the world
  double depth;        ///< how far b is to be moved along the normal to end the overlap; that of the deepest
                       ///< point, so along its normal where the patch is bent. The first point is as deep,
                       ///< but for rounding
  std::uint32_t pair;  ///< row of the list of object pairs
  std::uint32_t first_point, point_count;
  std::uint32_t flags;  ///< ManifoldFlags
};
static_assert(sizeof(Manifold) == 96);

/// Counts what became of a list of contacts.
struct ManifoldCounters {
  std::uint64_t contacts = 0;
  std::uint64_t segments = 0;  ///< contacts whose triangles share a line
  std::uint64_t manifolds = 0, points = 0;
  std::uint64_t open_curves = 0;        ///< manifolds with kOpenCurve
  std::uint64_t ambiguous_touches = 0;  ///< manifolds with kAmbiguous

  friend bool operator==(const ManifoldCounters&, const ManifoldCounters&) = default;
};

}  // namespace tandem
