#pragma once
#include <atomic>
#include <cstdint>
#include <span>

#include "kernels/contact/first_within.h"
#include "kernels/scene/scene_state.h"

namespace tandem {

/// Finds the contacts of object pairs of any posed trees, by the threads of a scene. Keeps its memory from
/// call to call.
class ContactFinder {
 public:
  /// trees: by the numbers that `pairs` name; contacts, counters: what is found. neighbours: what is left out
  /// of each tree, by the same numbers, where a pair is of a tree with itself; empty: nothing. Result: kOk,
  /// kOutOfMemory or kCannotStartThread.
  Status find(SceneState& scene, std::span<const PosedTree> trees, std::span<const ObjectPair> pairs,
              const ContactOptions& options, Buffer<Contact>& contacts, ContactCounters& counters,
              std::span<const Neighbourhood> neighbours = {});

 private:
  // The contacts of one chunk of pairs within those of the worker that took it.
  struct ChunkResult {
    std::uint32_t worker;
    std::size_t begin, end;
    std::size_t place;  // among the contacts of all
  };

  struct Worker {
    Buffer<Contact> contacts;
    Buffer<NearBlockPair> waiting;
    std::uint32_t workers = 1;  // of this call
    ContactCounters counters;
    bool enough_memory = true;
  };

  static bool grow_contacts(ContactSink& sink);
  bool provide_workers(const SceneState& scene);
  PairTask task_of(std::uint32_t pair) const;
  template <bool kWithoutNeighbours>
  void work(std::uint32_t worker);
  Status collect(SceneState& scene, Buffer<Contact>& contacts, ContactCounters& counters);

  NarrowPhase narrow_phase_ = nullptr;  // of this call
  std::span<const PosedTree> trees_;
  std::span<const ObjectPair> pairs_;
  std::span<const Neighbourhood> neighbours_;
  ContactOptions options_;
  PerWorker<Worker> workers_;
  std::uint32_t active_workers_ = 0;  // in this call
  std::size_t pairs_in_chunk_ = 1;
  Buffer<ChunkResult> chunks_;
  std::atomic<std::uint32_t> next_chunk_;
};

}  // namespace tandem
