#pragma once
#include <exception>
#include <memory>
#include <mutex>
#include <new>

#include "kernels/common/worker_threads.h"

namespace tandem::dynamics {

/// The threads that a step is made on. Copies are the same threads, and work for one at a time.
class Threads {
 public:
  /// threads: at most, the caller's included. Throws std::bad_alloc where a thread cannot be started.
  Threads(std::uint32_t threads) : workers_(std::make_shared<WorkerThreads>()), count_(threads) {
    if (!workers_->provide(threads)) throw std::bad_alloc();
  }

  std::uint32_t count() const { return count_; }

  /// Calls part(i) for each i below count, in no order, on any of the threads. Throws what a part threw.
  template <typename Part>
  void for_each(std::size_t count, const Part& part) {
    for_parts(count, 1, part);
  }

  /// for_each() for parts that are small: a thread takes `grain` at once.
  template <typename Part>
  void for_parts(std::size_t count, std::size_t grain, const Part& part) {
    std::exception_ptr thrown;
    std::mutex mutex;
    workers_->for_parts(count_, count, grain, [&](std::size_t begin, std::size_t end, std::uint32_t) {
      try {
        for (std::size_t i = begin; i < end; ++i) part(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        thrown = std::current_exception();
      }
    });
    if (thrown) std::rethrow_exception(thrown);
  }

  /// Calls work() on this thread and on others that come before it has returned there, together at most
  /// `workers`, which is not more than count(). It must return only when nothing is left to begin, and not
  /// throw.
  template <typename Work>
  void on_each(std::uint32_t workers, const Work& work) {
    workers_->run(
        workers, [](void* context, std::uint32_t) { (*static_cast<const Work*>(context))(); },
        const_cast<Work*>(&work));
  }

  /// Has them answer the questions about a scene, which must not outlive them. Throws QueryFailed.
  void work_for(Scene& scene) const;

 private:
  std::shared_ptr<WorkerThreads> workers_;
  std::uint32_t count_;
};

}  // namespace tandem::dynamics
