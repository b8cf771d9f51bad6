#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "dynamics/parallel/worker.h"
#include "dynamics/phases.h"
#include "dynamics/team.h"
#include "tandem/formats/status.h"

namespace tandem::dynamics {

/// Runs the parts of a parallel step on threads of the CPU. CudaExecutor has the same functions and queues
/// them on a GPU: so what is written for an executor runs on both.
///
/// What functions are given lies in the executor's memory, counts too: those that the CPU does not know yet.
/// `most`: how many there is room for; of a larger count no more are looked at.
class HostExecutor {
 public:
  /// Memory that grows and forgets.
  template <typename T>
  class Array {
   public:
    Status reserve(std::uint64_t count) {
      if (count > elements_.size()) elements_.clear(), elements_.resize(count);
      return Status::kOk;
    }
    /// The first `kept` elements stay.
    Status grow(std::uint64_t count, std::uint64_t) {
      if (count > elements_.size()) elements_.resize(count);
      return Status::kOk;
    }
    T* data() const { return const_cast<T*>(elements_.data()); }
    std::uint64_t room() const { return elements_.size(); }
    std::size_t bytes() const { return elements_.size() * sizeof(T); }

   private:
    std::vector<T> elements_;
  };

  static constexpr bool kHasManyWorkers = false;  ///< thousands, in together()

  /// Calls that are queued together, again and again.
  struct Sequence {};

  explicit HostExecutor(Threads& threads) : threads_(threads) {}

  /// Does what enqueue() does. key: equal where it queues the very same calls as before.
  template <typename Enqueue>
  void again(Sequence&, std::uint64_t key, const Enqueue& enqueue) {
    static_cast<void>(key);
    enqueue();
  }

  /// Makes room for sums and sorting of so many.
  Status reserve(std::uint32_t most) {
    static_cast<void>(most);
    return Status::kOk;
  }

  /// Calls visit(i) for each i below the count, or below `most` where count is null, in no order and side by
  /// side.
  template <typename Visit>
  void for_each(const std::uint32_t* count, std::uint32_t most, const Visit& visit) {
    const std::uint32_t all = below(count, most);
    threads_.for_parts(all, kAtOnce, [&](std::size_t i) { visit(static_cast<std::uint32_t>(i)); });
  }

  /// Calls visit(worker) for the workers of at most so many teams, all of which run at once, so that they may
  /// wait for each other. How many come is chance.
  template <typename Visit>
  void together(std::uint32_t most_teams, const Visit& visit) {
    const std::uint32_t teams = std::min(most_teams, threads_.count());
    if (teams == 0) return;
    run_phases(threads_, teams, 1, [&](std::size_t, std::uint32_t i, std::uint32_t n) {
      visit(Worker{i, n, 0, 1});
    });
  }

  /// Calls visit(team, i, shared) for each i below the count, by all threads of a team; see SerialTeam. The
  /// team may have more threads if visit.is_large(i).
  /// shared: a Shared that the team has for itself, of which nothing is known.
  template <typename Shared, typename Visit>
  void by_teams(const std::uint32_t* count, std::uint32_t most, const Visit& visit) {
    threads_.for_parts(below(count, most), 1, [&](std::size_t i) {
      Shared shared;
      visit(SerialTeam{}, static_cast<std::uint32_t>(i), shared);
    });
  }

  /// Calls visit(worker) for the workers of a cluster, if there can be one. Here it is a single worker.
  template <typename Visit>
  void in_cluster(const Visit& visit) {
    constexpr std::uint32_t kBytes = 1 << 20;
    own_of_block_.resize(kBytes / sizeof(Aligned));
    visit(ClusterWorker{0, 1, 0, 1, 0, 1, reinterpret_cast<char*>(own_of_block_.data()), kBytes});
  }

  /// Calls visit().
  template <typename Visit>
  void once(const Visit& visit) {
    visit();
  }

  /// Lists the numbers below the count of which is_in() is true, ascending, and says how many they are.
  template <typename IsIn>
  void select(const IsIn& is_in, const std::uint32_t* count, std::uint32_t most, std::uint32_t* list,
              std::uint32_t* listed) {
    std::uint32_t taken = 0;
    for (std::uint32_t i = 0; i < below(count, most); ++i) {
      if (is_in(i)) list[taken++] = i;
    }
    *listed = taken;
  }

  /// sums[i] becomes the sum of all values before i, of i from 0 to the count, up to which there must be
  /// room.
  void sum_before(const std::uint32_t* values, const std::uint32_t* count, std::uint32_t most,
                  std::uint32_t* sums) {
    std::uint32_t sum = 0;
    for (std::uint32_t i = 0; i <= most; ++i) {
      sums[i] = sum;
      if (i < below(count, most)) sum += values[i];
    }
  }

  /// Sorts values by ascending key, of which `bits` low bits count; equal ones keep their order. Keys beyond
  /// the count, up to `most`, are taken for the largest.
  void sort_by_key(std::uint32_t* keys, std::uint32_t* values, const std::uint32_t* count, std::uint32_t most,
                   int bits) {
    static_cast<void>(bits);
    std::vector<std::uint32_t> order(below(count, most));
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return keys[i]; });
    const std::vector<std::uint32_t> old_keys(keys, keys + order.size()), old(values, values + order.size());
    for (std::size_t i = 0; i < order.size(); ++i) keys[i] = old_keys[order[i]], values[i] = old[order[i]];
  }

  /// Copies to the executor's memory, and from it when all that was called for is done.
  template <typename T>
  Status copy(std::span<const T> from, T* to) {
    std::ranges::copy(from, to);
    return Status::kOk;
  }
  template <typename T>
  Status copy(const T* from, std::span<T> to) {
    std::copy_n(from, to.size(), to.begin());
    return Status::kOk;
  }

  /// Queues a copy within the executor's memory.
  template <typename T>
  void copy_within(const T* from, std::uint64_t count, T* to) {
    std::copy_n(from, count, to);
  }

  /// Copies a value, which is there after wait(): of several, the CPU waits once. It may be a small one.
  template <typename T>
  void copy_later(const T* from, T& to) {
    to = *from;
  }
  Status wait() { return Status::kOk; }

  Status status() const { return Status::kOk; }

 protected:
  static std::uint32_t below(const std::uint32_t* count, std::uint32_t most) {
    return count != nullptr ? std::min(*count, most) : most;
  }

 private:
  static constexpr std::size_t kAtOnce = 64;

  struct alignas(128) Aligned {
    char bytes[128];
  };

  Threads& threads_;
  std::vector<Aligned> own_of_block_;
};

}  // namespace tandem::dynamics
