#pragma once
#include "kernels/geometry/inside_test.h"
#include "tandem/kernels/containment_query.h"

namespace tandem::containment {

/// Returns whether a point lies in a box, touching included. What encloses a point encloses it in its box
/// too.
TANDEM_HD inline bool contains(const WorldBox& box, const double* p) {
  bool within = true;
  for (int k = 0; k < 3; ++k) within = within && box.lo[k] <= p[k] && p[k] <= box.hi[k];
  return within;
}

/// Returns whether a body may have a component to report, at a look: find_contained() reports none otherwise.
/// has_contacts: the bodies have contacts; so the component does, where there is one.
TANDEM_HD inline bool may_have_contained(const PosedSurface& inner, const PosedSurface& outer,
                                         bool has_contacts) {
  if (inner.surface->component_count != 1) return true;
  if (has_contacts) return false;
  double point[3];
  inner.corner(inner.surface->components[0].first_triangle, 0, point);
  return contains(outer.box(), point);
}

/// Reports the components of one body that have no contact with another and lie in it, or in the box of one
/// that is open, in ascending order.
///
/// One point tells of the whole component. It is connected, as edges join its posed triangles, and does not
/// meet the other surface. So it lies on one side of that.
///
/// inside(point): whether the point is inside the outer body's closed components. touches(label): whether a
/// contact of the pair is of the inner body's component whose first triangle is this one.
template <typename Inside, typename Touches, typename Report>
TANDEM_HD inline void find_contained(const PosedSurface& inner, const PosedSurface& outer, bool has_contacts,
                                     const Inside& inside, const Touches& touches, const Report& report) {
  if (!may_have_contained(inner, outer, has_contacts)) return;
  const WorldBox box = outer.box();
  for (std::uint32_t c = 0; c < inner.surface->component_count; ++c) {
    const std::uint32_t first = inner.surface->components[c].first_triangle;
    double point[3];
    inner.corner(first, 0, point);
    if (!contains(box, point)) continue;
    std::uint32_t flags = outer.surface->closed ? 0u : std::uint32_t{kOuterOpen};
    if (outer.surface->any_closed && inside(point)) flags |= kInside;
    if (flags != 0 && !(has_contacts && touches(first))) report(c, flags);
  }
}

}  // namespace tandem::containment
