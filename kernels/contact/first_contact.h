#pragma once
#include "kernels/contact/first_within.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {

/// Decides whether two posed trees touch, one pair after the other, for a thread. Keeps its memory.
class FirstContact {
 public:
  /// Counts anew.
  void begin() { sink_.counters = {}; }

  /// touch: whether a triangle of one meets one of the other, or is within the distance, as ContactQuery in
  /// mode exact decides with first_contact_only. False: out of memory.
  bool find(const PosedTree& a, const PosedTree& b, double within, bool& touch);

  std::uint64_t block_pairs() const { return sink_.counters.block_pairs; }

 private:
  static bool grow(ContactSink& sink);

  Buffer<Contact> contacts_;
  Buffer<NearBlockPair> waiting_;
  ContactSink sink_;
};

/// Returns the task that finds one contact of two posed trees at most.
PairTask first_contact_task(const PosedTree& a, const PosedTree& b, double within);

/// Does such a task, or any other of two posed trees, by the named way where it is in_frame. False: out of
/// memory.
inline bool run_contact_task(const PairTask& task, NarrowPhase way, ContactSink& sink,
                             Buffer<NearBlockPair>& waiting) {
  sink.gave_up = false;
  const bool enough_memory = (task.in_frame ? way : narrow_phase_by_world_boxes)(task, sink);
  return sink.gave_up ? find_first_within(task, sink, waiting) : enough_memory;
}

}  // namespace tandem
