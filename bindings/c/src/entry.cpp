#include "entry.h"

#include <algorithm>

namespace tandem::c {

tandem_status read_allocator(const tandem_allocator* given, Allocator& allocator) {
  tandem_allocator read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.reserved != 0) return TANDEM_BAD_OPTION;
  allocator = {read.user, read.allocate, read.deallocate};
  const bool complete = read.allocate != nullptr && read.deallocate != nullptr;
  return given == nullptr || complete ? TANDEM_OK : TANDEM_NULL_ARGUMENT;
}

size_t first_unknown_motion(const uint8_t* motion, size_t count) {
  const auto is_unknown = [](uint8_t value) { return value > TANDEM_SLEEPING; };
  return static_cast<size_t>(std::find_if(motion, motion + count, is_unknown) - motion);
}

}  // namespace tandem::c
