#pragma once
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>

#include "tandem/formats/allocator.h"
#include "tandem/kernels/scene.h"

namespace tandem {

/// Threads that wait for work, kept from call to call: as many as were ever asked for. Between two pieces of
/// work that follow each other closely they stay awake. Throws nothing.
class WorkerThreads {
 public:
  using Work = void (*)(void* context, std::uint32_t worker);

  WorkerThreads() = default;
  WorkerThreads(const WorkerThreads&) = delete;
  WorkerThreads& operator=(const WorkerThreads&) = delete;
  ~WorkerThreads() { stop(); }

  /// Starts threads for so many workers, the caller's included, where there are fewer; at most 65,535. False:
  /// a thread could not be started, and there are none.
  [[nodiscard]] bool provide(std::uint32_t workers);

  /// Calls work(context, 0) on this thread and work(context, 1 .. workers - 1) on others, where they wake
  /// before the first is done; returns when all that were called are. So work(context, 0) must return only
  /// when nothing is left to begin. There are threads for so many.
  void run(std::uint32_t workers, Work work, void* context);

  /// Calls part(begin, end, worker) for parts of [0, count) of `grain` each, the last of which may be
  /// shorter; on this thread alone for the whole range at once where there is one worker or one part. Which
  /// worker takes which part is chance.
  template <typename Part>
  void for_parts(std::uint32_t workers, std::size_t count, std::size_t grain, const Part& part) {
    const std::size_t parts = (count + grain - 1) / grain;
    if (workers <= 1 || parts <= 1) return part(std::size_t{0}, count, 0u);
    struct Job {
      const Part& part;
      std::size_t count, grain;
      std::atomic<std::size_t> next;
    } job = {part, count, grain, 0};
    const auto take_parts = [](void* context, std::uint32_t worker) {
      Job& of = *static_cast<Job*>(context);
      for (std::size_t begin; (begin = of.next.fetch_add(of.grain, std::memory_order_relaxed)) < of.count;)
        of.part(begin, std::min(of.count, begin + of.grain), worker);
    };
    run(static_cast<std::uint32_t>(std::min<std::size_t>(workers, parts)), take_parts, &job);
  }

 private:
  bool start(std::uint32_t threads);
  void stop();
  void wait_for_work(std::uint32_t worker);

  struct Thread : Allocated {
    std::thread thread;
  };

  std::unique_ptr<Thread[]> threads_;
  std::uint32_t thread_count_ = 0;

  std::mutex mutex_;
  std::condition_variable work_came_, work_done_;
  Work work_ = nullptr;
  void* context_ = nullptr;
  Allocator allocator_;  ///< of the caller
  /// This is the number of times that there was work, times 2^32; plus the workers that may begin it, the
  /// caller's included, times 2^16, 0 when none may any longer; plus the other threads at work. All is in one
  /// number, so that no thread begins what has ended.
  std::atomic<std::uint64_t> state_ = 0;
  bool stopping_ = false;
};

/// Has these threads, at most so many of them, answer the questions about a scene instead of its own. They
/// must outlive it, and work for one scene at a time. Result: as of Scene::set_threads().
Status share_threads(WorkerThreads& threads, std::uint32_t count, Scene& scene);

}  // namespace tandem
