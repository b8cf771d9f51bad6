#pragma once
#include <cstddef>
#include <span>

#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/impact_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/tolerance_query.h"
#include "tandem/tandem.h"

// Assertions that a row of a library and that of the interface lie alike.
#define TANDEM_SAME_SIZE(ours, theirs) \
  static_assert(sizeof(ours) == sizeof(theirs) && alignof(ours) >= alignof(theirs))
#define TANDEM_SAME_PLACE(ours, theirs, member) \
  static_assert(offsetof(ours, member) == offsetof(theirs, member))

/// Rows of the interface have the layout of the libraries' rows, so that they are handed over where they are.
namespace tandem::c {

#include "layouts.h"

TANDEM_SAME_SIZE(Motion, uint8_t);
static_assert(TANDEM_NO_INDEX == kNoIndex && TANDEM_OK == uint32_t(Status::kOk));
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

/// The libraries' rows as the caller reads them, null where there are none; count: or null.
template <typename Row, typename Found>
const Row* result(std::span<const Found> found, size_t* count) {
  if (count != nullptr) *count = found.size();
  return reinterpret_cast<const Row*>(found.empty() ? nullptr : found.data());
}

}  // namespace tandem::c
