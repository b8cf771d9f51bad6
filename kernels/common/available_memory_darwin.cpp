#include <mach/mach.h>

#include "tandem/kernels/detail/available_memory.h"

namespace tandem {

std::uint64_t available_memory_under(const char*) {
  vm_statistics64_data_t pages{};
  mach_msg_type_number_t words = HOST_VM_INFO64_COUNT;
  const mach_port_t host = mach_host_self();
  const kern_return_t got =
      host_statistics64(host, HOST_VM_INFO64, reinterpret_cast<host_info64_t>(&pages), &words);
  mach_port_deallocate(mach_task_self(), host);
  if (got != KERN_SUCCESS) return UINT64_MAX;
  return (std::uint64_t{pages.free_count} + pages.inactive_count) * vm_kernel_page_size;
}

}  // namespace tandem
