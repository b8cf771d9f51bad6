#pragma once
#include <atomic>
#include <cstdint>
#include <thread>

#include "tandem/formats/platform.h"

/// Workers that run at once read and write things by turns: each knows how many turns come before its own,
/// waits until the thing is at that turn, and hands on what it has made of the thing. So a thing needs no
/// lock, no barrier and no fence: its number of the turn and its data are read and written in one piece.
namespace tandem::dynamics {

/// Twelve bytes, and how many have had their turn at them.
struct alignas(16) TurnWord {
  std::uint32_t data[3];
  std::uint32_t turn;
};

/// Returns the word as it is now. If its turn is `turn` then the data are right, and stay: only who has the
/// turn may hand the word on.
TANDEM_HD inline TurnWord look_for_turn(const TurnWord& from, std::uint32_t turn) {
#ifdef __CUDA_ARCH__
  // 16 bytes are one access, to the cache that all processors share.
  static_cast<void>(turn);
  TurnWord out;
  asm volatile("ld.relaxed.gpu.global.v4.u32 {%0, %1, %2, %3}, [%4];"
               : "=r"(out.data[0]), "=r"(out.data[1]), "=r"(out.data[2]), "=r"(out.turn)
               : "l"(__cvta_generic_to_global(&from))
               : "memory");
  return out;
#else
  TurnWord out = {};
  out.turn = std::atomic_ref(const_cast<std::uint32_t&>(from.turn)).load(std::memory_order_acquire);
  for (int i = 0; i < 3 && out.turn == turn; ++i) out.data[i] = from.data[i];
  return out;
#endif
}

/// Hands on the word with these data to whose turn is `turn`.
TANDEM_HD inline void give_turn(TurnWord& to, std::uint32_t turn, const std::uint32_t (&data)[3]) {
#ifdef __CUDA_ARCH__
  asm volatile("st.relaxed.gpu.global.v4.u32 [%0], {%1, %2, %3, %4};" ::"l"(__cvta_generic_to_global(&to)),
               "r"(data[0]), "r"(data[1]), "r"(data[2]), "r"(turn)
               : "memory");
#else
  for (int i = 0; i < 3; ++i) to.data[i] = data[i];
  std::atomic_ref(to.turn).store(turn, std::memory_order_release);
#endif
}

/// Lets others run: whoever has the turn may be waiting for a processor.
TANDEM_HD inline void wait_for_turn() {
#ifdef __CUDA_ARCH__
  // Others have more of the memory's time while those who wait look less often.
  __nanosleep(100);
#else
  std::this_thread::yield();
#endif
}

}  // namespace tandem::dynamics
