#pragma once
#include <atomic>
#include <string>

namespace tandem::build {

/// A line on a terminal that says what is going on: "bvhbuild: build cow.obj ...". Prints nothing where
/// standard error is no terminal. Starts no thread, because import may fork.
class Progress {
 public:
  Progress(bool wanted, std::string what);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Replaces the line by that of the next step.
  void step(const char* name);

  /// Shows how much of the step is done, 0 to 1. One thread at a time.
  void share(double done);

  /// Takes the line away; call before printing anything else.
  void clear();

 private:
  bool shown_;
  std::string what_;
  int step_ = 0, percent_ = 0;
  const char* name_ = "";
};

/// While it lives, the first SIGINT (Ctrl-C) sets a flag instead of ending the process; the next one ends it.
/// Without a flag it does nothing. One at a time.
class StopOnInterrupt {
 public:
  explicit StopOnInterrupt(std::atomic<bool>* flag);
  ~StopOnInterrupt();
  StopOnInterrupt(const StopOnInterrupt&) = delete;
  StopOnInterrupt& operator=(const StopOnInterrupt&) = delete;

 private:
  void (*before_)(int) = nullptr;  ///< what SIGINT did
  bool installed_ = false;
};

}  // namespace tandem::build
