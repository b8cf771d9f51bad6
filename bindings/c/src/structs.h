#pragma once
#include <algorithm>
#include <cstring>

#include "tandem/tandem.h"

/// Structs that begin with their size, and so can grow: one rule for those that are read and those that are
/// filled.
namespace tandem::c {

/// No struct will ever be larger: what says so was not initialised.
inline constexpr uint32_t kLargestStruct = 4096;

/// The options as this version knows them. given: null for the defaults, which are zeros. first_size: of the
/// struct in the first version that had it. Result: TANDEM_OK or TANDEM_BAD_STRUCT_SIZE.
template <typename Struct>
tandem_status read_struct(const Struct* given, Struct& out, size_t first_size = sizeof(Struct)) {
  out = {};
  out.struct_size = sizeof(Struct);
  if (given == nullptr) return TANDEM_OK;
  const uint32_t size = given->struct_size;
  if (size < first_size || size > kLargestStruct) return TANDEM_BAD_STRUCT_SIZE;
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  const bool known = std::all_of(bytes + std::min<size_t>(size, sizeof(Struct)), bytes + size,
                                 [](unsigned char byte) { return byte == 0; });
  if (!known) return TANDEM_BAD_STRUCT_SIZE;
  std::memcpy(&out, given, std::min<size_t>(size, sizeof(Struct)));
  return TANDEM_OK;
}

/// Fills the caller's struct as far as it goes; what this version does not know becomes zero. Its size stays.
template <typename Struct>
tandem_status write_struct(Struct from, Struct* to, size_t first_size = sizeof(Struct)) {
  if (to == nullptr) return TANDEM_NULL_ARGUMENT;
  const uint32_t size = to->struct_size;
  if (size < first_size || size > kLargestStruct) return TANDEM_BAD_STRUCT_SIZE;
  from.struct_size = size;
  std::memset(static_cast<void*>(to), 0, size);
  std::memcpy(static_cast<void*>(to), &from, std::min<size_t>(size, sizeof(Struct)));
  return TANDEM_OK;
}

}  // namespace tandem::c
