#include "worker_threads.h"

#include <exception>
#include <new>

namespace tandem {

bool WorkerThreads::run(std::uint32_t workers, Work work, void* context) {
  if (workers > thread_count_ + 1 && !start(workers - 1)) return false;
  if (workers > 1) {
    const std::lock_guard lock(mutex_);
    work_ = work;
    context_ = context;
    workers_ = workers;
    working_ = workers - 1;
    ++round_;
    work_came_.notify_all();
  }
  work(context, 0);
  if (workers > 1) {
    std::unique_lock lock(mutex_);
    work_done_.wait(lock, [this] { return working_ == 0; });
  }
  return true;
}

bool WorkerThreads::start(std::uint32_t threads) {
  stop();
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
    if (worker >= workers_) continue;
    lock.unlock();
    work_(context_, worker);
    lock.lock();
    if (--working_ == 0) work_done_.notify_one();
  }
}

}  // namespace tandem
