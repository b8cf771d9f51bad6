#pragma once
#include <nanobind/nanobind.h>

#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "without_lock.h"

namespace tandem::python {

/// Long work and the thread that waits for it talk to each other through this.
struct Watch {
  std::atomic<double> share = 0;   ///< that is done
  std::atomic<bool> stop = false;  ///< the work is to end soon
};

/// Work that heeds Watch::stop throws this. Nobody catches it: what made the work stop is thrown in its
/// place.
struct Stopped {};

/// Runs work() in a thread of its own, without the interpreter's lock. Meanwhile the caller's thread, so that
/// Ctrl-C works, looks for signals and calls progress(share) where it is not None. What either raises, and
/// what work() throws, is thrown here once work() has ended.
template <typename Work>
void run_with_patience(Watch& watch, nanobind::handle progress, const Work& work) {
  std::mutex mutex;
  std::condition_variable ended;
  bool done = false;
  std::exception_ptr thrown;
  std::thread worker([&] {
    try {
      work();
    } catch (...) {
      thrown = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    done = true;
    ended.notify_one();
  });
  const auto join = [&] {
    const WithoutLock other_threads_run;
    worker.join();
  };
  const auto done_soon = [&] {
    const WithoutLock other_threads_run;
    std::unique_lock lock(mutex);
    return ended.wait_for(lock, std::chrono::milliseconds(50), [&] { return done; });
  };
  try {
    double told = 0;
    while (!done_soon()) {
      if (PyErr_CheckSignals() != 0) throw nanobind::python_error();
      if (const double share = watch.share; !progress.is_none() && share != told)
        sleep_once_python_ended([&] { progress(told = share); });
    }
  } catch (...) {
    watch.stop = true;
    join();
    throw;
  }
  join();
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace tandem::python
