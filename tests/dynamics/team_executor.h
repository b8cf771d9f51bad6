#pragma once
#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "dynamics/parallel/host_executor.h"

namespace tandem::dynamics {

/// Threads wait here for each other, again and again. std::barrier of libstdc++ 12 for Windows does so for
/// ever, now and then: its threads sleep by a wait for a number, and miss that it changed.
class Meeting {
 public:
  explicit Meeting(std::uint32_t threads) : threads_(threads) {}

  void come_and_wait() {
    std::unique_lock lock(mutex_);
    const std::uint64_t own = held_;
    if (++here_ == threads_) {
      here_ = 0, ++held_;
      all_came_.notify_all();
    } else {
      all_came_.wait(lock, [&] { return held_ != own; });
    }
  }

 private:
  std::mutex mutex_;
  std::condition_variable all_came_;
  std::uint32_t threads_, here_ = 0;
  std::uint64_t held_ = 0;  // meetings
};

/// Several threads of the CPU as a team, see SerialTeam. It sums up as a block of 128 threads of a GPU does,
/// whatever the number of threads.
class ThreadTeam {
 public:
  static constexpr bool kIsMany = true;
  static constexpr std::uint32_t kLanes = 128;

  /// What the threads share.
  struct Shared {
    explicit Shared(std::uint32_t threads) : meeting(threads) {}
    Meeting meeting;
    double of_lane[3][kLanes];
  };

  ThreadTeam(Shared& shared, std::uint32_t rank, std::uint32_t size)
      : shared_(shared), rank_(rank), size_(size) {}

  std::uint32_t rank() const { return rank_; }
  std::uint32_t size() const { return size_; }
  void barrier() const { shared_.meeting.come_and_wait(); }
  template <typename Visit>
  void each(std::uint32_t count, const Visit& visit) const {
    for (std::uint32_t i = rank_; i < count; i += size_) visit(i);
  }
  template <int kCount, typename Add>
  Sums<kCount> sum(Sums<kCount> start, std::uint32_t count, const Add& add) const {
    each(kLanes, [&](std::uint32_t lane) {
      Sums<kCount> own = {};
      for (std::uint32_t i = lane; i < count; i += kLanes) add(i, own);
      for (int k = 0; k < kCount; ++k) shared_.of_lane[k][lane] = own.of[k];
    });
    barrier();
    for (int k = 0; k < kCount; ++k) {
      for (std::uint32_t warp = 0; warp < kLanes; warp += 32) {
        double halves[32];
        std::copy_n(shared_.of_lane[k] + warp, 32, halves);
        for (int half = 16; half > 0; half /= 2) {
          for (int i = 0; i < half; ++i) halves[i] += halves[i + half];
        }
        start.of[k] += halves[0];
      }
    }
    barrier();
    return start;
  }
  template <typename Of>
  double most(double start, std::uint32_t count, const Of& of) const {
    double own = start;
    each(count, [&](std::uint32_t i) { own = std::max(own, of(i)); });
    shared_.of_lane[0][rank_] = own;
    barrier();
    for (std::uint32_t i = 0; i < size_; ++i) start = std::max(start, shared_.of_lane[0][i]);
    barrier();
    return start;
  }

 private:
  Shared& shared_;
  std::uint32_t rank_, size_;
};

/// Does what HostExecutor does, with teams of several threads.
class TeamExecutor : public HostExecutor {
 public:
  TeamExecutor(Threads& threads, std::uint32_t team) : HostExecutor(threads), team_(team) {}

  template <typename Shared, typename Visit>
  void by_teams(const std::uint32_t* count, std::uint32_t most, const Visit& visit) {
    for (std::uint32_t i = 0; i < below(count, most); ++i) {
      Shared shared;
      ThreadTeam::Shared of_team(team_);
      std::vector<std::thread> threads;
      for (std::uint32_t rank = 0; rank < team_; ++rank)
        threads.emplace_back([&, rank] { visit(ThreadTeam(of_team, rank, team_), i, shared); });
      for (std::thread& thread : threads) thread.join();
    }
  }

 private:
  std::uint32_t team_;
};

}  // namespace tandem::dynamics
