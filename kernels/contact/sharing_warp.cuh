#pragma once
#include "kernels/contact/gpu_query_data.h"
#include "kernels/contact/walk_memory.cuh"
#include "kernels/contact/work_sharing.h"

// WorkSharing asks this of a warp of the GPU.
namespace tandem::gpu {
namespace {

class SharingWarp {
 public:
  static constexpr std::uint32_t kLanes = 32, kNoTicket = 0xFFFFFFFFu;
  static constexpr int kEntryWords = 2;
  static constexpr std::uint32_t kSharedWords = 8;  ///< of a warp: the ticket kept, the last look at `counts`
  static constexpr std::uint32_t kFreeWord = 1, kFreeWords = 3;  ///< of them, those between the two

  /// memory: address of kSharedWords in shared memory, a multiple of 16 bytes. Condition: all lanes call it.
  __device__ SharingWarp(const QueryArgs& args, Balance& balance, std::uint32_t memory, std::uint32_t lane)
      : args_(args), balance_(balance), memory_(memory), lane_(lane) {
    if (lane_ == 0) keep_ticket(kNoTicket);
  }

  __device__ bool is_first() const { return lane_ == 0; }
  __device__ void sync() const { __syncwarp(); }
  __device__ void sleep() const { __nanosleep(100); }
  __device__ void spin() const {}

  /// The first lane's value.
  template <class Value>
  __device__ Value broadcast(Value value) const {
    return __shfl_sync(kAllLanes, value, 0);
  }
  template <class Of>
  __device__ void each_lane(std::uint32_t count, Of of) const {
    if (lane_ < count) of(lane_);
  }

  __device__ static std::uint32_t tickets_end() { return kEndOfTickets; }
  __device__ std::uint32_t mailbox_bits() const { return args_.shape.mailbox_bits; }
  __device__ std::uint32_t kept_ticket() const { return load_shared(memory_); }
  __device__ void keep_ticket(std::uint32_t ticket) const { store_shared(memory_, ticket); }

  /// Begins to fetch `counts`. The read is weak: it may come late, and each half of the word by itself. See
  /// work_sharing.h, (1): only the halves that say what waits and what was given are used, each for itself.
  __device__ void begin_look() const {
    __syncwarp();  // all lanes have read what was seen before
    if (lane_ == 0)
      asm volatile("cp.async.cg.shared.global [%0], [%1], 16;" ::"r"(memory_ + 16), "l"(&balance_.counts)
                   : "memory");
  }
  __device__ void end_look() const {
    asm volatile("cp.async.wait_all;" ::: "memory");
    __syncwarp();
  }
  __device__ Counter seen() const { return load_shared_long(memory_ + 16); }

  __device__ Counter add(Counter amount) const { return add_relaxed(&balance_.counts, amount); }
  __device__ Counter add_release(Counter amount) const { return gpu::add_release(&balance_.counts, amount); }
  __device__ Counter compare_and_swap(Counter expected, Counter desired) const {
    return compare_and_swap_acquire(&balance_.counts, expected, desired);
  }

  __device__ std::uint32_t load_mailbox(std::uint32_t place) const {
    return load_relaxed(&balance_.mailbox[place]);
  }
  __device__ std::uint32_t acquire_mailbox(std::uint32_t place) const {
    return load_acquire(&balance_.mailbox[place]);
  }
  __device__ void store_mailbox(std::uint32_t place, std::uint32_t word) const {
    store_relaxed(&balance_.mailbox[place], word);
  }
  __device__ void release_mailbox(std::uint32_t place, std::uint32_t word) const {
    store_release(&balance_.mailbox[place], word);
  }
  __device__ void raise_mailbox(std::uint32_t place, std::uint32_t word) const {
    raise_relaxed(&balance_.mailbox[place], word);
  }

  __device__ void store_entry(std::uint32_t place, std::uint32_t lane,
                              const std::uint64_t (&words)[2]) const {
    store_relaxed2(args_.chunks[place].entry[lane], words[0], words[1]);
  }
  __device__ std::uint64_t exchange_entry_word(std::uint32_t place, std::uint32_t lane, int word) const {
    return exchange_relaxed(&args_.chunks[place].entry[lane][word], 0);
  }

 private:
  const QueryArgs& args_;
  Balance& balance_;
  std::uint32_t memory_;  // address
  std::uint32_t lane_;
};

}  // namespace
}  // namespace tandem::gpu
