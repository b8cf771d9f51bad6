#include <windows.h>

#include "tandem/kernels/detail/available_memory.h"

namespace tandem {

std::uint64_t available_memory_under(const char*) {
  MEMORYSTATUSEX memory{};
  memory.dwLength = sizeof memory;
  return GlobalMemoryStatusEx(&memory) ? memory.ullAvailPageFile : UINT64_MAX;
}

}  // namespace tandem
