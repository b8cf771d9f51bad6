#pragma once
#include <cstdint>

namespace tandem {

/// Bytes of memory that this process can still use without being killed for it: what the machine has
/// available, and what is left of the limits of its control groups (a container's, say), where that is less.
/// Linux grants allocations beyond that and kills who writes to them. On Windows: what the process can still
/// have of memory and page files. On macOS: free pages and inactive ones. UINT64_MAX where it is unknown, as
/// on other systems. Allocates nothing.
std::uint64_t available_memory();

/// Returns the available memory according to the files below another root folder, for tests on Linux.
std::uint64_t available_memory_under(const char* root);

}  // namespace tandem
