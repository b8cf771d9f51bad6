#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/pair_record.h"

// The warps of a walk read and write shared memory of their multiprocessor, and what they share in the GPU's,
// by these functions.
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
__device__ inline Counter load_shared_long(std::uint32_t address) {
  Counter word;
  asm volatile("ld.shared.u64 %0, [%1];" : "=l"(word) : "r"(address));
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
/// Result: the word before.
__device__ inline std::uint32_t add_shared(std::uint32_t address, std::uint32_t amount) {
  std::uint32_t before;
  asm volatile("atom.shared.add.u32 %0, [%1], %2;" : "=r"(before) : "r"(address), "r"(amount) : "memory");
  return before;
}
__device__ inline void store_shared4(std::uint32_t address, const uint4& words) {
  asm volatile("st.shared.v4.u32 [%0], {%1, %2, %3, %4};" ::"r"(address), "r"(words.x), "r"(words.y),
               "r"(words.z), "r"(words.w)
               : "memory");
}

// Words that warps of all multiprocessors share. Each word is reached at one width.
__device__ inline std::uint32_t load_relaxed(const std::uint32_t* from) {
  std::uint32_t word;
  asm volatile("ld.relaxed.gpu.global.u32 %0, [%1];" : "=r"(word) : "l"(from) : "memory");
  return word;
}
__device__ inline std::uint32_t load_acquire(const std::uint32_t* from) {
  std::uint32_t word;
  asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(word) : "l"(from) : "memory");
  return word;
}
__device__ inline void store_relaxed(std::uint32_t* to, std::uint32_t word) {
  asm volatile("st.relaxed.gpu.global.u32 [%0], %1;" ::"l"(to), "r"(word) : "memory");
}
__device__ inline void store_release(std::uint32_t* to, std::uint32_t word) {
  asm volatile("st.release.gpu.global.u32 [%0], %1;" ::"l"(to), "r"(word) : "memory");
}
/// Two words, each by itself. Condition: a multiple of 16 bytes.
__device__ inline void store_relaxed2(Counter* to, Counter first, Counter second) {
  asm volatile("st.relaxed.gpu.global.v2.u64 [%0], {%1, %2};" ::"l"(to), "l"(first), "l"(second) : "memory");
}

// Atomic operations. Result: the word before.
__device__ inline Counter add_relaxed(Counter* to, Counter amount) {
  Counter before;
  asm volatile("atom.add.relaxed.gpu.global.u64 %0, [%1], %2;"
               : "=l"(before)
               : "l"(to), "l"(amount)
               : "memory");
  return before;
}
__device__ inline Counter add_release(Counter* to, Counter amount) {
  Counter before;
  asm volatile("atom.add.release.gpu.global.u64 %0, [%1], %2;"
               : "=l"(before)
               : "l"(to), "l"(amount)
               : "memory");
  return before;
}
__device__ inline Counter compare_and_swap_acquire(Counter* to, Counter expected, Counter desired) {
  Counter before;
  asm volatile("atom.cas.acquire.gpu.global.b64 %0, [%1], %2, %3;"
               : "=l"(before)
               : "l"(to), "l"(expected), "l"(desired)
               : "memory");
  return before;
}
__device__ inline Counter exchange_relaxed(Counter* to, Counter word) {
  Counter before;
  asm volatile("atom.exch.relaxed.gpu.global.b64 %0, [%1], %2;"
               : "=l"(before)
               : "l"(to), "l"(word)
               : "memory");
  return before;
}
/// Makes the word at least so large.
__device__ inline void raise_relaxed(std::uint32_t* to, std::uint32_t word) {
  asm volatile("red.max.relaxed.gpu.global.u32 [%0], %1;" ::"l"(to), "r"(word) : "memory");
}

}  // namespace
}  // namespace tandem::gpu
