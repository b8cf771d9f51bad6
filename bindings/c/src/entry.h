#pragma once
#include <new>

#include "structs.h"
#include "tandem/formats/allocator.h"

/// How functions of the interface begin.
namespace tandem::c {

/// The caller's allocator; null: that of the C library. Result: TANDEM_OK, TANDEM_BAD_STRUCT_SIZE,
/// TANDEM_BAD_OPTION, or TANDEM_NULL_ARGUMENT where a function is missing.
tandem_status read_allocator(const tandem_allocator* given, Allocator& allocator);

/// Runs the body of a function of a handle: its memory comes from the handle's allocator, and nothing is
/// thrown.
template <typename Of, typename Body>
tandem_status guarded(Of* handle, const Body& body) noexcept {
  if (handle == nullptr) return TANDEM_NULL_ARGUMENT;
  const AllocatorScope scope(handle->allocator);
  try {
    return body(*handle);
  } catch (...) {
    return TANDEM_INTERNAL_ERROR;
  }
}

/// Whether a list is where it must be.
inline bool is_there(const void* list, size_t count) {
  return list != nullptr || count == 0;
}

/// The first entry that is no motion; `count` where all are.
size_t first_unknown_motion(const uint8_t* motion, size_t count);

}  // namespace tandem::c
