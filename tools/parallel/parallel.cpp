#include "parallel.h"

#if defined(__linux__)
#include <sched.h>
#endif

#include <exception>
#include <system_error>
#include <thread>
#include <vector>

namespace tandem::parallel {
namespace {

using Spare = std::atomic<std::size_t>;

// The number of further threads that may work on what this thread asks for; null: those of the process.
thread_local Spare* limit_here = nullptr;

Spare& spare_here() {
  static Spare of_process = usable_threads() - 1;
  return limit_here != nullptr ? *limit_here : of_process;
}

std::size_t take(Spare& spare, std::size_t most) {
  std::size_t there = spare.load(std::memory_order_relaxed), taken;
  do {
    taken = std::min(there, most);
  } while (taken > 0 && !spare.compare_exchange_weak(there, there - taken, std::memory_order_relaxed));
  return taken;
}

// Threads at one piece of work.
class Team {
 public:
  Team(Spare& spare, std::size_t size, void (*work)(void*), void* context)
      : spare_(spare), work_(work), context_(context), working_(size) {}

  void take_part() {
    try {
      work_(context_);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
    }
    leave();
  }

  // A thread that has done its part makes room for others, but for the last one: in its place, the thread
  // that asked for the work goes on. So waiting threads do not count.
  void leave() {
    if (working_.fetch_sub(1, std::memory_order_relaxed) > 1) ++spare_;
  }

  void start(std::vector<std::thread>& threads) {
    threads.emplace_back([this] {
      limit_here = &spare_;
      take_part();
    });
  }

  void throw_again() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  Spare& spare_;
  void (*work_)(void*);
  void* context_;
  std::atomic<std::size_t> working_;
  std::mutex mutex_;
  std::exception_ptr failure_;
};

}  // namespace

unsigned usable_threads() {
#if defined(__linux__)
  cpu_set_t usable;
  if (sched_getaffinity(0, sizeof usable, &usable) == 0)
    return static_cast<unsigned>(std::max(CPU_COUNT(&usable), 1));
#endif
  return std::max(std::thread::hardware_concurrency(), 1u);
}

ThreadLimit::ThreadLimit(unsigned threads) : spare_(threads - 1), before_(limit_here) {
  if (threads > 0) limit_here = &spare_;
}

ThreadLimit::~ThreadLimit() {
  limit_here = before_;
}

void run_together(std::size_t most, void (*work)(void*), void* context) {
  Spare& spare = spare_here();
  const std::size_t others = most > 1 ? take(spare, most - 1) : 0;
  if (others == 0) return work(context);
  Team team(spare, others + 1, work, context);
  std::vector<std::thread> threads;
  std::size_t started = 0;
  try {
    threads.reserve(others);
    for (; started < others; ++started) team.start(threads);
  } catch (const std::exception&) {  // no memory, or the system's refusal: then fewer take part
    for (; started < others; ++started) team.leave();
  }
  team.take_part();
  for (std::thread& thread : threads) thread.join();
  team.throw_again();
}

}  // namespace tandem::parallel
