#pragma once
#include <cstddef>
#include <new>

namespace tandem {

/// The functions that the CPU code of formats/, runtime/ and kernels/ takes memory from. Both may be called
/// by several threads at a time, and throw nothing.
struct Allocator {
  void* user = nullptr;  ///< handed to both functions
  /// Memory of so many bytes at a multiple of `alignment`, a power of two; null where there is none.
  void* (*allocate)(void* user, std::size_t bytes, std::size_t alignment) = nullptr;
  /// Takes back what allocate() gave for these numbers.
  void (*deallocate)(void* user, void* memory, std::size_t bytes, std::size_t alignment) = nullptr;
};

/// While it lives, what this thread allocates, and what queries that it calls allocate on threads of theirs,
/// comes from `allocator`; without its functions, from the C library. Memory goes back to where it came from,
/// whatever is in force then. What the system takes to start a thread comes from elsewhere.
class AllocatorScope {
 public:
  explicit AllocatorScope(const Allocator& allocator);
  ~AllocatorScope();
  AllocatorScope(const AllocatorScope&) = delete;
  AllocatorScope& operator=(const AllocatorScope&) = delete;

 private:
  Allocator before_;
};

/// The allocator in force on this thread.
const Allocator& current_allocator();

inline constexpr std::size_t kMemoryAlignment = 128;

/// Memory from the current allocator, at a multiple of kMemoryAlignment; null where there is none.
[[nodiscard]] void* allocate(std::size_t bytes);

/// Takes back what allocate() gave; null too.
void deallocate(void* memory);

/// A base of what new (std::nothrow) takes from the current allocator.
struct Allocated {
  static void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes); }
  static void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes); }
  static void operator delete(void* memory) { deallocate(memory); }
  static void operator delete[](void* memory) { deallocate(memory); }
};

}  // namespace tandem
