#pragma once
#include <cstddef>

/// Assertions that a row of a library and that of the interface lie alike.
#define TANDEM_SAME_SIZE(ours, theirs) \
  static_assert(sizeof(ours) == sizeof(theirs) && alignof(ours) >= alignof(theirs))
#define TANDEM_SAME_PLACE(ours, theirs, member) \
  static_assert(offsetof(ours, member) == offsetof(theirs, member))
