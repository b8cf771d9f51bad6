#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>

#include "dynamics/threads.h"

namespace tandem::dynamics {

/// A part of all: from `begin` to `end`.
struct PhasePart {
  std::size_t begin, end;
};

/// Returns part i of n of as many things, contiguous and as large as the others.
inline PhasePart part_of(std::size_t things, std::uint32_t i, std::uint32_t n) {
  return {things * i / n, things * (i + 1) / n};
}

/// Calls work(phase, i, n) for each phase below `phases` and i below n, phase after phase: a phase begins
/// when all calls of the one before have ended, and calls of one phase run side by side. n is how many
/// threads come at once, at most `workers`, and the same in all phases. They must not throw.
template <typename Work>
void run_phases(Threads& threads, std::uint32_t workers, std::size_t phases, const Work& work) {
  if (workers == 1) {
    for (std::size_t phase = 0; phase < phases; ++phase) work(phase, 0u, 1u);
    return;
  }
  struct alignas(64) Counter {
    std::atomic<std::uint64_t> value = 0;
  } come, closed, done;
  const auto wait_until = [](const auto& condition) {
    constexpr int kLooks = 4000;  // some microseconds
    for (int look = 0; !condition(); ++look) {
      if (look > kLooks) std::this_thread::yield();
    }
  };
  threads.on_each(workers, [&] {
    // Whoever comes late goes again: the first closes the door when all are there, or have had time to be.
    constexpr std::uint64_t kClosed = std::uint64_t{1} << 32;
    const std::uint64_t before = come.value.fetch_add(1, std::memory_order_acq_rel);
    if (before >= kClosed) return;
    const auto i = static_cast<std::uint32_t>(before);
    if (i == 0) {
      constexpr int kLooks = 20'000;
      for (int look = 0; look < kLooks && come.value.load(std::memory_order_relaxed) < workers; ++look) {
      }
      closed.value.store(come.value.fetch_or(kClosed, std::memory_order_acq_rel), std::memory_order_release);
    } else {
      wait_until([&] { return closed.value.load(std::memory_order_acquire) != 0; });
    }
    const auto n = static_cast<std::uint32_t>(closed.value.load(std::memory_order_acquire));
    for (std::size_t phase = 0; phase < phases; ++phase) {
      work(phase, i, n);
      done.value.fetch_add(1, std::memory_order_acq_rel);
      wait_until([&] { return done.value.load(std::memory_order_acquire) >= (phase + 1) * n; });
    }
  });
}

}  // namespace tandem::dynamics
