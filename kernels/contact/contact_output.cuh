#pragma once
#include "kernels/contact/gpu_query_data.h"
#include "kernels/contact/walk_memory.cuh"

// The contacts that a warp of the walk found, gathered in shared memory until 32 can be written at once.
//
// Included by files that are compiled with and without fused operations: internal linkage.
namespace tandem::gpu {
namespace {

/// All lanes of the warp call each function.
class ContactOutput {
 public:
  static constexpr std::uint32_t kRoom = 64;  ///< contacts: 31 that wait, and 32 more
  static constexpr std::uint32_t kSharedWords = 5 * kRoom;

  /// memory: address of kSharedWords.
  __device__ ContactOutput(std::uint32_t memory, std::uint32_t lane) : memory_(memory), lane_(lane) {}

  /// Adds the contact of each lane that has one.
  __device__ void add(const QueryArgs& args, bool mine, const Contact& contact) {
    const std::uint32_t lanes = __ballot_sync(kAllLanes, mine);
    if (lanes == 0) return;
    if (mine) {
      const std::uint32_t words[5] = {contact.pair, contact.triangle_a, contact.triangle_b, contact.face_a,
                                      contact.face_b};
      const std::uint32_t place = count_ + __popc(lanes & ((1u << lane_) - 1));
#pragma unroll
      for (int i = 0; i < 5; ++i) store_shared(at(i, place), words[i]);
    }
    count_ += __popc(lanes);
    __syncwarp();
    if (count_ >= 32) write(args, 32);
  }

  /// Writes what is left.
  __device__ void finish(const QueryArgs& args) {
    if (count_ != 0) write(args, count_);
  }

 private:
  /// Address of a word of a contact.
  __device__ std::uint32_t at(int word, std::uint32_t contact) const {
    return memory_ + 4 * (kRoom * word + contact);
  }

  /// Writes the last contacts; 0 < count <= 32.
  __device__ void write(const QueryArgs& args, std::uint32_t count) {
    count_ -= count;
    Counter first = 0;
    if (lane_ == 0) first = atomicAdd(&args.state->contacts, static_cast<Counter>(count));
    const Counter place = __shfl_sync(kAllLanes, first, 0) + lane_;
    std::uint32_t words[5];
#pragma unroll
    for (int i = 0; i < 5; ++i) words[i] = load_shared(at(i, (count_ + lane_) % kRoom));
    if (lane_ < count && place < args.capacity.contacts)
      args.contacts[place] = {words[0], words[1], words[2], words[3], words[4]};
    __syncwarp();
  }

  const std::uint32_t memory_;  // address
  const std::uint32_t lane_;
  std::uint32_t count_ = 0;
};

}  // namespace
}  // namespace tandem::gpu
