#pragma once
#include <array>
#include <cstddef>
#include <span>

#include "entry.h"
#include "tandem/dynamics/world.h"
#include "tandem/kernels/bodies_at_query.h"
#include "tandem/kernels/closest_query.h"
#include "tandem/kernels/configuration_query.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/impact_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/ray_query.h"
#include "tandem/kernels/tolerance_query.h"

// Assertions that a row of a library, Ours, and that of the interface, Theirs, lie alike.
#define TANDEM_SAME_SIZE() static_assert(sizeof(Ours) == sizeof(Theirs) && alignof(Ours) >= alignof(Theirs))
#define TANDEM_SAME(member) static_assert(offsetof(Ours, member) == offsetof(Theirs, member))

/// Rows of the interface have the layout of the libraries' rows, so that they are handed over where they are.
namespace tandem::c {

#include "layouts.h"

static_assert(TANDEM_NO_INDEX == kNoIndex && TANDEM_OK == uint32_t(Status::kOk));
static_assert(sizeof(Motion) == sizeof(uint8_t));
static_assert(TANDEM_MOVING == int(Motion::moving) && TANDEM_FIXED == int(Motion::fixed) &&
              TANDEM_KINEMATIC == int(Motion::kinematic) && TANDEM_SLEEPING == int(Motion::sleeping));
static_assert(TANDEM_BALL == int(JointKind::ball) && TANDEM_HINGE == int(JointKind::hinge) &&
              TANDEM_SLIDER == int(JointKind::slider) && TANDEM_FIXED_JOINT == int(JointKind::fixed) &&
              TANDEM_DISTANCE == int(JointKind::distance));
static_assert(TANDEM_EXACT == int(QueryMode::exact) && TANDEM_FAST == int(QueryMode::fast) &&
              TANDEM_BOXES == int(QueryMode::boxes));
static_assert(TANDEM_TOUCHING == int(kTouching) && TANDEM_OPEN_CURVE == int(kOpenCurve) &&
              TANDEM_GOES_THROUGH == int(kGoesThrough) && TANDEM_AMBIGUOUS == int(kAmbiguous));
static_assert(TANDEM_INSIDE == int(kInside) && TANDEM_OUTER_OPEN == int(kOuterOpen));
static_assert(TANDEM_APART == int(ToleranceVerdict::apart) &&
              TANDEM_TOUCH == int(ToleranceVerdict::touching) &&
              TANDEM_WITHIN_TOLERANCE == int(ToleranceVerdict::within_tolerance));
static_assert(TANDEM_FIRST_HIT == int(RayHits::first) && TANDEM_ANY_HIT == int(RayHits::any) &&
              TANDEM_ALL_HITS == int(RayHits::all));
static_assert(TANDEM_NO_IMPACT == int(ImpactStatus::none) && TANDEM_IMPACT == int(ImpactStatus::found) &&
              TANDEM_IMPACT_AT_START == int(ImpactStatus::at_start));

/// The caller's rows as the libraries read them.
template <typename Row, typename Given>
std::span<const Row> rows(const Given* given, size_t count) {
  return {reinterpret_cast<const Row*>(given), count};
}

/// Points or directions, three numbers each.
inline std::span<const std::array<double, 3>> triples(const double* given, size_t count) {
  return {reinterpret_cast<const std::array<double, 3>*>(given), count};
}

/// The libraries' rows as the caller reads them, null where there are none; count: or null.
template <typename Row, typename Found>
const Row* result(std::span<const Found> found, size_t* count) {
  if (count != nullptr) *count = found.size();
  return reinterpret_cast<const Row*>(found.empty() ? nullptr : found.data());
}

/// The options of manifolds, on the CPU or on a GPU. keep: null where pairs cannot be kept. Result:
/// TANDEM_OK, TANDEM_BAD_STRUCT_SIZE or TANDEM_BAD_OPTION.
inline tandem_status read_manifold_options(const tandem_manifold_options* given, ManifoldOptions& options,
                                           bool* keep = nullptr) {
  tandem_manifold_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.most_points > kMostManifoldPoints || read.ignore_previous > 1 || read.quick_depths > 1 ||
      read.keep > (keep != nullptr ? 1 : 0))
    return TANDEM_BAD_OPTION;
  options.match_previous = read.ignore_previous == 0;
  options.quick_depths = read.quick_depths != 0;
  if (keep != nullptr) *keep = read.keep != 0;
  if (read.most_points != 0) options.most_points = read.most_points;
  return TANDEM_OK;
}

}  // namespace tandem::c
