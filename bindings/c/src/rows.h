#pragma once
#include <span>

#include "same_layout.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/impact_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/tolerance_query.h"
#include "tandem/tandem.h"

/// Rows of the interface have the layout of the libraries' rows, so that they are handed over where they are.
namespace tandem::c {

TANDEM_SAME_SIZE(Pose, tandem_pose);
TANDEM_SAME_PLACE(Pose, tandem_pose, translation);
TANDEM_SAME_SIZE(Instance, tandem_instance);
TANDEM_SAME_PLACE(Instance, tandem_instance, pose);
TANDEM_SAME_SIZE(ObjectPair, tandem_object_pair);
TANDEM_SAME_PLACE(ObjectPair, tandem_object_pair, b);
TANDEM_SAME_SIZE(Triangle, tandem_triangle);
TANDEM_SAME_SIZE(Triangle::Corner, tandem_corner);
TANDEM_SAME_SIZE(Contact, tandem_contact);
TANDEM_SAME_PLACE(Contact, tandem_contact, triangle_a);
TANDEM_SAME_PLACE(Contact, tandem_contact, triangle_b);
TANDEM_SAME_PLACE(Contact, tandem_contact, face_a);
TANDEM_SAME_PLACE(Contact, tandem_contact, face_b);
TANDEM_SAME_SIZE(Manifold, tandem_manifold);
TANDEM_SAME_PLACE(Manifold, tandem_manifold, area_vector);
TANDEM_SAME_PLACE(Manifold, tandem_manifold, centre);
TANDEM_SAME_PLACE(Manifold, tandem_manifold, depth);
TANDEM_SAME_PLACE(Manifold, tandem_manifold, pair);
TANDEM_SAME_PLACE(Manifold, tandem_manifold, first_point);
TANDEM_SAME_PLACE(Manifold, tandem_manifold, point_count);
TANDEM_SAME_PLACE(Manifold, tandem_manifold, flags);
TANDEM_SAME_SIZE(ManifoldPoint, tandem_manifold_point);
TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, in_a);
TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, in_b);
TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, depth);
TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, id);
TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, face_a);
TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, face_b);
TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, previous);
TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, manifold);
TANDEM_SAME_SIZE(Containment, tandem_containment);
TANDEM_SAME_PLACE(Containment, tandem_containment, inner);
TANDEM_SAME_PLACE(Containment, tandem_containment, component);
TANDEM_SAME_PLACE(Containment, tandem_containment, flags);
TANDEM_SAME_SIZE(FormerNearest, tandem_former_nearest);
TANDEM_SAME_PLACE(FormerNearest, tandem_former_nearest, triangle_a);
TANDEM_SAME_PLACE(FormerNearest, tandem_former_nearest, triangle_b);
TANDEM_SAME_SIZE(ObjectDistance, tandem_distance);
TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, upper);
TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, point_a);
TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, point_b);
TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, triangle_a);
TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, triangle_b);
TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, face_a);
TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, face_b);
TANDEM_SAME_SIZE(PairVerdict, tandem_verdict);
TANDEM_SAME_PLACE(PairVerdict, tandem_verdict, level_a);
TANDEM_SAME_PLACE(PairVerdict, tandem_verdict, level_b);
TANDEM_SAME_SIZE(RigidMotion, tandem_motion);
TANDEM_SAME_PLACE(RigidMotion, tandem_motion, angular_velocity);
TANDEM_SAME_PLACE(RigidMotion, tandem_motion, center);
TANDEM_SAME_SIZE(Impact, tandem_impact);
TANDEM_SAME_PLACE(Impact, tandem_impact, gap);
TANDEM_SAME_PLACE(Impact, tandem_impact, point_a);
TANDEM_SAME_PLACE(Impact, tandem_impact, point_b);
TANDEM_SAME_PLACE(Impact, tandem_impact, triangle_a);
TANDEM_SAME_PLACE(Impact, tandem_impact, triangle_b);
TANDEM_SAME_PLACE(Impact, tandem_impact, face_a);
TANDEM_SAME_PLACE(Impact, tandem_impact, face_b);
TANDEM_SAME_PLACE(Impact, tandem_impact, status);
TANDEM_SAME_SIZE(Motion, uint8_t);

static_assert(TANDEM_NO_INDEX == kNoIndex);
static_assert(TANDEM_MOVING == int(Motion::moving) && TANDEM_FIXED == int(Motion::fixed) &&
              TANDEM_KINEMATIC == int(Motion::kinematic) && TANDEM_SLEEPING == int(Motion::sleeping));
static_assert(TANDEM_EXACT == int(QueryMode::exact) && TANDEM_FAST == int(QueryMode::fast) &&
              TANDEM_BOXES == int(QueryMode::boxes));
static_assert(TANDEM_TOUCHING == int(kTouching) && TANDEM_OPEN_CURVE == int(kOpenCurve) &&
              TANDEM_GOES_THROUGH == int(kGoesThrough));
static_assert(TANDEM_INSIDE == int(kInside) && TANDEM_OUTER_OPEN == int(kOuterOpen));
static_assert(TANDEM_APART == int(ToleranceVerdict::apart) &&
              TANDEM_TOUCH == int(ToleranceVerdict::touching) &&
              TANDEM_WITHIN_TOLERANCE == int(ToleranceVerdict::within_tolerance));
static_assert(TANDEM_NO_IMPACT == int(ImpactStatus::none) && TANDEM_IMPACT == int(ImpactStatus::found) &&
              TANDEM_IMPACT_AT_START == int(ImpactStatus::at_start));

/// The caller's rows as the libraries read them.
template <typename Row, typename Given>
std::span<const Row> rows(const Given* given, size_t count) {
  return {reinterpret_cast<const Row*>(given), count};
}

/// The libraries' rows as the caller reads them; count: or null.
template <typename Row, typename Found>
const Row* result(std::span<const Found> found, size_t* count) {
  if (count != nullptr) *count = found.size();
  return reinterpret_cast<const Row*>(found.data());
}

}  // namespace tandem::c
