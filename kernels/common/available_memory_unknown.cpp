#include "tandem/kernels/detail/available_memory.h"

namespace tandem {

std::uint64_t available_memory_under(const char*) {
  return UINT64_MAX;
}

}  // namespace tandem
