#include "tandem/kernels/detail/available_memory.h"

// This function has a file of its own, so that a test can have an available_memory() of its own.
namespace tandem {

std::uint64_t available_memory() {
  return available_memory_under("");
}

}  // namespace tandem
