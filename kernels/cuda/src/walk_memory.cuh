#pragma once
#include <cuda_runtime.h>

#include <cstdint>

// How the warps of a walk read and write what they share: memory of their multiprocessor and of the GPU.
//
// Included by files that are compiled with and without fused operations: internal linkage.
namespace tandem::gpu {
namespace {

// Shared memory by its own addresses: as pointers, the compiler would compute them anew all the time.
__device__ inline std::uint32_t load_shared(std::uint32_t address) {
  std::uint32_t word;
  asm volatile("ld.shared.u32 %0, [%1];" : "=r"(word) : "r"(address));
  return word;
}
__device__ inline uint4 load_shared4(std::uint32_t address) {
  uint4 words;
  asm volatile("ld.shared.v4.u32 {%0, %1, %2, %3}, [%4];"
               : "=r"(words.x), "=r"(words.y), "=r"(words.z), "=r"(words.w)
               : "r"(address));
  return words;
}
__device__ inline void store_shared(std::uint32_t address, std::uint32_t word) {
  asm volatile("st.shared.u32 [%0], %1;" ::"r"(address), "r"(word) : "memory");
}
__device__ inline void store_shared4(std::uint32_t address, const uint4& words) {
  asm volatile("st.shared.v4.u32 [%0], {%1, %2, %3, %4};" ::"r"(address), "r"(words.x), "r"(words.y),
               "r"(words.z), "r"(words.w)
               : "memory");
}

__device__ inline std::uint32_t load_acquire(const std::uint32_t* from) {
  std::uint32_t word;
  asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(word) : "l"(from) : "memory");
  return word;
}
/// Without the order of an acquire, which empties the L1 cache every time.
__device__ inline std::uint32_t load_relaxed(const std::uint32_t* from) {
  std::uint32_t word;
  asm volatile("ld.relaxed.gpu.global.u32 %0, [%1];" : "=r"(word) : "l"(from) : "memory");
  return word;
}
/// The value before.
__device__ inline std::uint32_t subtract_release(std::uint32_t* from, std::uint32_t amount) {
  std::uint32_t before;
  asm volatile("atom.add.release.gpu.global.u32 %0, [%1], %2;"
               : "=r"(before)
               : "l"(from), "r"(0u - amount)
               : "memory");
  return before;
}
/// Entries that warps give to each other: all 16 bytes at once, so that they need no order with a mailbox. Of
/// an earlier turn none is left: it was cleared before the mailbox was given back, and a GPU's memory keeps
/// the order of what comes to one address.
__device__ inline void store_entry(uint4* to, const uint4& entry) {
  const std::uint64_t low = std::uint64_t{entry.y} << 32 | entry.x,
                      high = std::uint64_t{entry.w} << 32 | entry.z;
  asm volatile("{.reg .b128 all; mov.b128 all, {%1, %2}; st.relaxed.gpu.global.b128 [%0], all;}" ::"l"(to),
               "l"(low), "l"(high)
               : "memory");
}
__device__ inline uint4 load_entry(const uint4* from) {
  std::uint64_t low, high;
  asm volatile("{.reg .b128 all; ld.relaxed.gpu.global.b128 all, [%2]; mov.b128 {%0, %1}, all;}"
               : "=l"(low), "=l"(high)
               : "l"(from)
               : "memory");
  return {static_cast<std::uint32_t>(low), static_cast<std::uint32_t>(low >> 32),
          static_cast<std::uint32_t>(high), static_cast<std::uint32_t>(high >> 32)};
}
__device__ inline void store_relaxed(std::uint32_t* to, std::uint32_t word) {
  asm volatile("st.relaxed.gpu.global.u32 [%0], %1;" ::"l"(to), "r"(word) : "memory");
}
__device__ inline void store_release(std::uint32_t* to, std::uint32_t word) {
  asm volatile("st.release.gpu.global.u32 [%0], %1;" ::"l"(to), "r"(word) : "memory");
}

}  // namespace
}  // namespace tandem::gpu
