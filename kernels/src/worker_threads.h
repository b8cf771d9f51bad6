#pragma once
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>

namespace tandem {

/// Threads that wait for work, kept from call to call: as many as were ever asked for. Throws nothing.
class WorkerThreads {
 public:
  using Work = void (*)(void* context, std::uint32_t worker);

  WorkerThreads() = default;
  WorkerThreads(const WorkerThreads&) = delete;
  WorkerThreads& operator=(const WorkerThreads&) = delete;
  ~WorkerThreads() { stop(); }

  /// Calls work(context, 0) on this thread and work(context, 1 .. workers - 1) on others; returns when all
  /// are done. False: a thread could not be started, and nothing was called.
  [[nodiscard]] bool run(std::uint32_t workers, Work work, void* context);

 private:
  bool start(std::uint32_t threads);
  void stop();
  void wait_for_work(std::uint32_t worker);

  std::unique_ptr<std::thread[]> threads_;
  std::uint32_t thread_count_ = 0;

  std::mutex mutex_;
  std::condition_variable work_came_, work_done_;
  Work work_ = nullptr;
  void* context_ = nullptr;
  std::uint64_t round_ = 0;    // of work; a worker that has seen less has work to do
  std::uint32_t workers_ = 0;  // of this round, the caller's thread included
  std::uint32_t working_ = 0;
  bool stopping_ = false;
};

}  // namespace tandem
