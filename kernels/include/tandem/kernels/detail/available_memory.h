#pragma once
#include <cstdint>

namespace tandem {

/// Bytes of memory that this process can still use without being killed for it: what the machine has
/// available, and what is left of the limits of its control groups (a container's, say), where that is less.
/// Linux grants allocations beyond that and kills who writes to them. UINT64_MAX where it is unknown, as on
/// other systems. Reads files; allocates nothing.
std::uint64_t available_memory();

/// Returns the available memory according to the files below another root folder, for tests.
std::uint64_t available_memory_under(const char* root);

}  // namespace tandem
