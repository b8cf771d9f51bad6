#include "kernels/common/worker_threads.h"

#include <exception>
#include <new>

namespace tandem {

namespace {

constexpr int kRoundShift = 32, kWorkersShift = 16;
constexpr std::uint64_t kLow = (1u << 16) - 1;

std::uint64_t round_of(std::uint64_t state) {
  return state >> kRoundShift;
}
std::uint64_t workers_of(std::uint64_t state) {
  return state >> kWorkersShift & kLow;
}
std::uint64_t at_work(std::uint64_t state) {
  return state & kLow;
}

// A thread looks this often before it sleeps, about a tenth of a millisecond: longer than what lies between
// two phases of a query, and about what waking a thread takes.
constexpr int kLooks = 512;

// Returns whether it came true while this thread was awake.
template <typename Condition>
bool comes_soon(const Condition& condition) {
  for (int look = 0; look < kLooks; ++look) {
    if (condition()) return true;
    std::this_thread::yield();
  }
  return false;
}

}  // namespace

bool WorkerThreads::provide(std::uint32_t workers) {
  return workers <= thread_count_ + 1 || start(workers - 1);
}

void WorkerThreads::run(std::uint32_t workers, Work work, void* context) {
  if (workers == 1) return work(context, 0);
  {
    const std::lock_guard lock(mutex_);
    work_ = work;
    context_ = context;
    allocator_ = current_allocator();
    const std::uint64_t round = round_of(state_.load(std::memory_order_relaxed)) + 1;
    state_.store(round << kRoundShift | std::uint64_t{workers} << kWorkersShift, std::memory_order_release);
  }
  work_came_.notify_all();
  work(context, 0);
  state_.fetch_and(~(kLow << kWorkersShift), std::memory_order_relaxed);
  const auto done = [this] { return at_work(state_.load(std::memory_order_acquire)) == 0; };
  if (comes_soon(done)) return;
  std::unique_lock lock(mutex_);
  work_done_.wait(lock, done);
}

bool WorkerThreads::start(std::uint32_t threads) {
  stop();
  threads_.reset(new (std::nothrow) Thread[threads]);
  if (threads_ == nullptr) return false;
  stopping_ = false;
  state_ = 0;
  try {
    while (thread_count_ < threads) {
      const std::uint32_t worker = thread_count_ + 1;
      threads_[thread_count_].thread = std::thread([this, worker] { wait_for_work(worker); });
      ++thread_count_;
    }
  } catch (const std::exception&) {  // the system's refusal, or no memory
    stop();
    return false;
  }
  return true;
}

void WorkerThreads::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    work_came_.notify_all();
  }
  for (std::uint32_t i = 0; i < thread_count_; ++i) threads_[i].thread.join();
  threads_.reset();
  thread_count_ = 0;
}

void WorkerThreads::wait_for_work(std::uint32_t worker) {
  std::uint64_t seen = 0;  // the last round
  const auto came = [&] { return round_of(state_.load(std::memory_order_relaxed)) != seen; };
  for (;;) {
    if (!comes_soon(came)) {
      std::unique_lock lock(mutex_);
      work_came_.wait(lock, [&] { return stopping_ || came(); });
      if (stopping_) return;
    }
    std::uint64_t state = state_.load(std::memory_order_relaxed);
    while (worker < workers_of(state) &&
           !state_.compare_exchange_weak(state, state + 1, std::memory_order_acquire,
                                         std::memory_order_relaxed)) {
    }
    seen = round_of(state);
    if (worker >= workers_of(state)) continue;
    {
      const AllocatorScope scope(allocator_);
      work_(context_, worker);
    }
    const std::uint64_t before = state_.fetch_sub(1, std::memory_order_release);
    if (at_work(before) > 1 || workers_of(before) > 0) continue;
    const std::lock_guard lock(mutex_);  // so that the caller sleeps or has seen it
    work_done_.notify_one();
  }
}

}  // namespace tandem
