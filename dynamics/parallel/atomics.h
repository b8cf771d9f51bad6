#pragma once
#include <atomic>
#include <cstdint>

#include "tandem/formats/platform.h"

// What several visits of HostExecutor or CudaExecutor may do to the same number at once. The results do not
// depend on who comes first.
namespace tandem::dynamics {

TANDEM_HD inline void atomic_least(std::uint32_t& of, std::uint32_t x) {
#ifdef __CUDA_ARCH__
  atomicMin(&of, x);
#else
  std::atomic_ref<std::uint32_t> to(of);
  for (std::uint32_t now = to.load(); x < now && !to.compare_exchange_weak(now, x);) {
  }
#endif
}

TANDEM_HD inline void atomic_most(std::uint32_t& of, std::uint32_t x) {
#ifdef __CUDA_ARCH__
  atomicMax(&of, x);
#else
  std::atomic_ref<std::uint32_t> to(of);
  for (std::uint32_t now = to.load(); x > now && !to.compare_exchange_weak(now, x);) {
  }
#endif
}

/// Condition: both are not less than 0.
TANDEM_HD inline void atomic_most(double& of, double x) {
#ifdef __CUDA_ARCH__
  // Such numbers are in the order of their bits. Most visits find a larger one already.
  if (!(x > *static_cast<volatile double*>(&of))) return;
  atomicMax(reinterpret_cast<unsigned long long*>(&of),
            static_cast<unsigned long long>(__double_as_longlong(x)));
#else
  std::atomic_ref<double> to(of);
  for (double now = to.load(); x > now && !to.compare_exchange_weak(now, x);) {
  }
#endif
}

/// Returns what was there before.
TANDEM_HD inline std::uint32_t atomic_add(std::uint32_t& of, std::uint32_t x) {
#ifdef __CUDA_ARCH__
  return atomicAdd(&of, x);
#else
  return std::atomic_ref<std::uint32_t>(of).fetch_add(x);
#endif
}

TANDEM_HD inline void atomic_add(std::uint64_t& of, std::uint64_t x) {
#ifdef __CUDA_ARCH__
  atomicAdd(reinterpret_cast<unsigned long long*>(&of), static_cast<unsigned long long>(x));
#else
  std::atomic_ref<std::uint64_t>(of).fetch_add(x);
#endif
}

/// Returns a number that others may be changing.
TANDEM_HD inline std::uint32_t look_at(const std::uint32_t& from) {
#ifdef __CUDA_ARCH__
  return *static_cast<const volatile std::uint32_t*>(&from);
#else
  return std::atomic_ref<std::uint32_t>(const_cast<std::uint32_t&>(from)).load(std::memory_order_relaxed);
#endif
}

/// Adds 1 where less than `most` is seen, so that a count becomes no less than `most` if it would without
/// that. A count that has reached it is only looked at.
TANDEM_HD inline void add_up_to(std::uint32_t& of, std::uint32_t most) {
  if (look_at(of) < most) atomic_add(of, 1);
}

TANDEM_HD inline void atomic_or(std::uint32_t& of, std::uint32_t bits) {
#ifdef __CUDA_ARCH__
  if ((*static_cast<volatile std::uint32_t*>(&of) & bits) != bits) atomicOr(&of, bits);
#else
  std::atomic_ref<std::uint32_t>(of).fetch_or(bits);
#endif
}

TANDEM_HD inline void atomic_or(std::uint64_t& of, std::uint64_t bits) {
#ifdef __CUDA_ARCH__
  atomicOr(reinterpret_cast<unsigned long long*>(&of), static_cast<unsigned long long>(bits));
#else
  std::atomic_ref<std::uint64_t>(of).fetch_or(bits);
#endif
}

/// Writes `x` where `from` is. Returns what was there before.
TANDEM_HD inline std::uint32_t atomic_exchange_if(std::uint32_t& of, std::uint32_t from, std::uint32_t x) {
#ifdef __CUDA_ARCH__
  return atomicCAS(&of, from, x);
#else
  std::atomic_ref<std::uint32_t>(of).compare_exchange_strong(from, x);
  return from;
#endif
}

}  // namespace tandem::dynamics
