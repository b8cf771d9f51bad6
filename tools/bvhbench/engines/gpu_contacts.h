#pragma once
#include "gpu_engine.h"

namespace tandem {

/// Contacts in GPU memory.
struct GpuContacts {
  const Contact* data;
  std::size_t count;
};

/// A query for contacts behind Tandem's broad phase, both on the current GPU.
class GpuContactEngine : public GpuEngine {
 public:
  void query(std::span<const ObjectPair> pairs) final;
  bool contacts(std::vector<TriangleContact>& found) final;

  /// The query runs until everything has room, then again for each repeat, timed by events.
  TimedAnswer time_query(const TimedQuery& asked) final;

 protected:
  using GpuEngine::GpuEngine;

  /// Finds the contacts of these pairs, of instances(), and waits for them.
  virtual void ask(const GpuPairs& pairs, OrderOnGpu order) = 0;

  /// Returns what the last ask(), or repeat of it, found, and sets counters_.
  virtual GpuContacts found() = 0;

  /// Queues on stream() what comes before a query: the pairs, and an event that is recorded with these flags.
  using Before = std::function<void(unsigned event_flags)>;

  /// Returns a function that queues `before` and the query of these pairs once more. Conditions: ask() of the
  /// same went well; what `before` looks at stays.
  virtual std::function<void()> repeatable(const GpuPairs& pairs, OrderOnGpu order, const Before& before) = 0;

  /// Returns a function that queues the same with contact manifolds of what the query finds, behind
  /// `between`.
  virtual std::function<void()> repeatable_with_manifolds(const GpuPairs&, OrderOnGpu, const Before&,
                                                          const Before&) {
    cannot("make manifolds");
  }

  /// Returns a function that queues `before`, the query of the pairs that have moved by more than a tolerance
  /// and the manifolds of all. It has run once, so that there are manifolds to keep.
  virtual std::function<void()> repeatable_with_kept_manifolds(const GpuPairs&, double, const Before&) {
    cannot("keep manifolds");
  }

  /// Takes the manifolds that the last repeat made; their rows are those of the GPU's pairs.
  virtual void take_manifolds(TimedManifolds&) {}

  /// Times the walk of the trees alone.
  virtual Seconds time_walk(const GpuPairs&, std::uint32_t) { return {}; }

  /// GPU memory of the query, and what its rule says it is at most; 0: there is no rule.
  virtual std::size_t query_bytes() const = 0;
  virtual std::size_t most_bytes(OrderOnGpu) const { return 0; }

 private:
  void time_answer(const GpuPairs& pairs, const TimedQuery& asked, TimedAnswer& answer);
  void time_kept(const GpuPairs& pairs, const TimedQuery& asked, TimedAnswer& answer);
  void take(const GpuPairs& pairs, const GpuContacts& contacts, OrderOnGpu order, TimedAnswer& answer) const;
  std::size_t most_bytes_of(const TimedQuery& asked) const;

  PinnedArray<Contact> contacts_;
};

}  // namespace tandem
