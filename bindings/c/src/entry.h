#pragma once
#include <algorithm>
#include <cstring>
#include <new>

#include "tandem/formats/allocator.h"
#include "tandem/formats/status.h"
#include "tandem/tandem.h"

/// Functions of the interface begin and end with these.
namespace tandem::c {

/// Statuses of the libraries have the numbers of tandem.h, which scripts/write_interface compares.
inline tandem_status to_c(Status status) {
  return static_cast<tandem_status>(status);
}

/// No struct will ever be larger: what says so was not initialised. None has grown since the first version
/// that had it, so that the least size is that of now.
inline constexpr uint32_t kLargestStruct = 4096;

/// The options as this version knows them. given: null for the defaults, which are zeros. Result: TANDEM_OK
/// or TANDEM_BAD_STRUCT_SIZE.
template <typename Struct>
tandem_status read_struct(const Struct* given, Struct& out) {
  out = {};
  out.struct_size = sizeof(Struct);
  if (given == nullptr) return TANDEM_OK;
  const uint32_t size = given->struct_size;
  if (size < sizeof(Struct) || size > kLargestStruct) return TANDEM_BAD_STRUCT_SIZE;
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  const auto is_zero = [](unsigned char byte) { return byte == 0; };
  if (!std::all_of(bytes + sizeof(Struct), bytes + size, is_zero)) return TANDEM_BAD_STRUCT_SIZE;
  std::memcpy(&out, given, sizeof(Struct));
  return TANDEM_OK;
}

/// Fills the caller's struct; what this version does not know of it becomes zero. Its size stays.
template <typename Struct>
tandem_status write_struct(Struct from, Struct* to) {
  if (to == nullptr) return TANDEM_NULL_ARGUMENT;
  const uint32_t size = to->struct_size;
  if (size < sizeof(Struct) || size > kLargestStruct) return TANDEM_BAD_STRUCT_SIZE;
  from.struct_size = size;
  std::memset(static_cast<void*>(to), 0, size);
  std::memcpy(static_cast<void*>(to), &from, sizeof(Struct));
  return TANDEM_OK;
}

/// The caller's allocator; null: that of the C library. Result: TANDEM_OK, TANDEM_BAD_STRUCT_SIZE,
/// TANDEM_BAD_OPTION, or TANDEM_NULL_ARGUMENT where a function is missing.
inline tandem_status read_allocator(const tandem_allocator* given, Allocator& allocator) {
  tandem_allocator read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.reserved != 0) return TANDEM_BAD_OPTION;
  allocator = {read.user, read.allocate, read.deallocate};
  const bool complete = read.allocate != nullptr && read.deallocate != nullptr;
  return given == nullptr || complete ? TANDEM_OK : TANDEM_NULL_ARGUMENT;
}

/// Makes a handle whose memory comes from the caller's allocator, by what `fill` does to an empty one.
/// Result: as of read_allocator() or `fill`, or TANDEM_OUT_OF_MEMORY. After an error *handle is null.
template <typename Of, typename Fill>
tandem_status create(const tandem_allocator* given, Of** handle, const Fill& fill) noexcept {
  if (handle == nullptr) return TANDEM_NULL_ARGUMENT;
  *handle = nullptr;
  Allocator allocator;
  if (const tandem_status status = read_allocator(given, allocator); status != TANDEM_OK) return status;
  const AllocatorScope scope(allocator);
  Of* const made = new (std::nothrow) Of;
  if (made == nullptr) return TANDEM_OUT_OF_MEMORY;
  made->allocator = allocator;
  tandem_status status = TANDEM_INTERNAL_ERROR;
  try {
    status = fill(*made);
  } catch (const std::bad_alloc&) {
    status = TANDEM_OUT_OF_MEMORY;
  } catch (...) {
  }
  if (status == TANDEM_OK) {
    *handle = made;
  } else {
    delete made;
  }
  return status;
}

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

/// Returns whether a list is where it must be.
inline bool is_there(const void* list, size_t count) {
  return list != nullptr || count == 0;
}

/// The first entry that is no motion; `count` where all are.
inline size_t first_unknown_motion(const uint8_t* motion, size_t count) {
  const auto is_unknown = [](uint8_t value) { return value > TANDEM_SLEEPING; };
  return static_cast<size_t>(std::find_if(motion, motion + count, is_unknown) - motion);
}

}  // namespace tandem::c
