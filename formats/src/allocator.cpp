#include "tandem/formats/allocator.h"

#include <cstdint>
#include <cstdlib>
#include <new>

#if defined(_WIN32)  // its C library has functions of its own for aligned memory
#include <malloc.h>
#endif

namespace tandem {
namespace {

// This stands in front of memory that was given out.
struct Origin {
  Allocator allocator;
  std::size_t bytes;  // with this
};
static_assert(sizeof(Origin) <= kMemoryAlignment);

#if defined(_WIN32)
void* from_c_library(void*, std::size_t bytes, std::size_t alignment) {
  return _aligned_malloc(bytes, alignment);
}

void to_c_library(void*, void* memory, std::size_t, std::size_t) {
  _aligned_free(memory);
}
#else
void* from_c_library(void*, std::size_t bytes, std::size_t alignment) {
  return std::aligned_alloc(alignment, bytes);
}

void to_c_library(void*, void* memory, std::size_t, std::size_t) {
  std::free(memory);
}
#endif

constexpr Allocator kCLibrary = {nullptr, from_c_library, to_c_library};

thread_local constinit Allocator current = kCLibrary;

}  // namespace

AllocatorScope::AllocatorScope(const Allocator& allocator) : before_(current) {
  current = allocator.allocate != nullptr && allocator.deallocate != nullptr ? allocator : kCLibrary;
}

AllocatorScope::~AllocatorScope() {
  current = before_;
}

const Allocator& current_allocator() {
  return current;
}

// aligned_alloc() wants a multiple of the alignment.
void* allocate(std::size_t bytes) {
  if (bytes > SIZE_MAX - 2 * kMemoryAlignment) return nullptr;
  const std::size_t all = (bytes + 2 * kMemoryAlignment - 1) / kMemoryAlignment * kMemoryAlignment;
  void* memory = current.allocate(current.user, all, kMemoryAlignment);
  if (memory == nullptr) return nullptr;
  ::new (memory) Origin{current, all};
  return static_cast<std::byte*>(memory) + kMemoryAlignment;
}

void deallocate(void* memory) {
  if (memory == nullptr) return;
  void* const all = static_cast<std::byte*>(memory) - kMemoryAlignment;
  const Origin origin = *static_cast<const Origin*>(all);
  origin.allocator.deallocate(origin.allocator.user, all, origin.bytes, kMemoryAlignment);
}

}  // namespace tandem
