#include "worker_threads.h"

#include <exception>
#include <new>

namespace tandem {

bool WorkerThreads::run(std::uint32_t workers, Work work, void* context) {
  const std::uint32_t others = workers - 1;
  if (others != thread_count_ && !start(others)) return false;
  if (others > 0) {
    const std::lock_guard lock(mutex_);
    work_ = work;
    context_ = context;
    working_ = others;
    ++round_;
    work_came_.notify_all();
  }
  work(context, 0);
  if (others > 0) {
    std::unique_lock lock(mutex_);
    work_done_.wait(lock, [this] { return working_ == 0; });
  }
  return true;
}

bool WorkerThreads::start(std::uint32_t threads) {
  stop();
  if (threads == 0) return true;
  threads_.reset(new (std::nothrow) std::thread[threads]);
  if (threads_ == nullptr) return false;
  stopping_ = false;
  round_ = 0;
  try {
    while (thread_count_ < threads) {
      const std::uint32_t worker = thread_count_ + 1;
      threads_[thread_count_] = std::thread([this, worker] { wait_for_work(worker); });
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
  for (std::uint32_t i = 0; i < thread_count_; ++i) threads_[i].join();
  threads_.reset();
  thread_count_ = 0;
}

void WorkerThreads::wait_for_work(std::uint32_t worker) {
  std::uint64_t seen = 0;
  std::unique_lock lock(mutex_);
  for (;;) {
    work_came_.wait(lock, [&] { return stopping_ || round_ > seen; });
    if (stopping_) return;
    seen = round_;
    lock.unlock();
    work_(context_, worker);
    lock.lock();
    if (--working_ == 0) work_done_.notify_one();
  }
}

}  // namespace tandem
