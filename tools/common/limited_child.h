#pragma once
#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace tandem {

struct ChildLimits {
  double seconds = 120;                                 ///< of the wall clock, from start()
  std::uint64_t memory_bytes = std::uint64_t{8} << 30;  ///< of address space, beyond what the parent has
};

/// Returns whether the memory limit holds in this build. It does not hold under sanitizers, which reserve
/// terabytes of address space.
bool limits_memory();

/// Says how a child came to its end.
enum class ChildEnd {
  finished,       ///< returned from its work
  out_of_time,    ///< was still running at the deadline
  out_of_memory,  ///< an allocation failed
  crashed,        ///< died of a signal, see signal()
  lost            ///< ended in another way
};

/// A forked copy of this process that does one piece of work nobody vouches for, under limits, and writes its
/// result to a pipe. It writes no files, prints nothing, leaves no core, and dies with its parent.
class LimitedChild {
 public:
  /// Writes bytes to the parent. What it cannot write, because the parent has gone, ends the child.
  using Sink = std::function<void(const void* bytes, std::size_t count)>;

  LimitedChild() = default;
  /// Kills and reaps the child.
  ~LimitedChild();
  LimitedChild(const LimitedChild&) = delete;
  LimitedChild& operator=(const LimitedChild&) = delete;

  /// Result: empty, or why there is no child. Must be called while the process has a single thread.
  std::string start(const ChildLimits& limits, const std::function<void(const Sink&)>& work);

  /// Reads exactly `count` bytes; false when the pipe ends before or the deadline passes.
  bool read(void* to, std::size_t count);

  /// Waits for the end of the child, at most until the deadline, then kills it. Call once, when reading
  /// failed.
  ChildEnd finish();

  /// The signal that the child died of, after ChildEnd::crashed.
  int signal() const { return signal_; }

 private:
  bool wait_readable();
  bool reap(bool block, int& status);
  int milliseconds_left() const;

  pid_t pid_ = -1;
  int pipe_ = -1;
  int signal_ = 0;
  std::chrono::steady_clock::time_point deadline_;
};

}  // namespace tandem
