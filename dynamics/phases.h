#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <thread>

#include "dynamics/threads.h"

namespace tandem::dynamics {

/// Calls part(phase, i) for each i below parts[phase], phase after phase: a phase begins when all parts of
/// the one before are done. Parts of one phase run side by side, and in no order. They must not throw.
template <typename Part>
void run_phases(Threads& threads, std::span<const std::uint32_t> parts, const Part& part) {
  if (threads.count() == 1) {
    for (std::size_t phase = 0; phase < parts.size(); ++phase) {
      for (std::uint32_t i = 0; i < parts[phase]; ++i) part(phase, i);
    }
    return;
  }
  // Each takes the next part of all, and waits until those of earlier phases are done. These have all been
  // taken by then, so that whoever waits waits for threads that work.
  struct alignas(64) Counter {
    std::atomic<std::uint64_t> value = 0;
  } taken, done;
  threads.on_each([&] {
    std::uint64_t begin = 0;  // of the phase
    std::size_t phase = 0;
    for (;;) {
      const std::uint64_t next = taken.value.fetch_add(1, std::memory_order_relaxed);
      for (; phase < parts.size() && next >= begin + parts[phase]; ++phase) begin += parts[phase];
      if (phase == parts.size()) return;
      constexpr int kLooks = 2000;
      for (int look = 0; done.value.load(std::memory_order_acquire) < begin; ++look) {
        if (look > kLooks) std::this_thread::yield();
      }
      part(phase, static_cast<std::uint32_t>(next - begin));
      done.value.fetch_add(1, std::memory_order_release);
    }
  });
}

}  // namespace tandem::dynamics
