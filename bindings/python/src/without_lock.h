#pragma once
#include <nanobind/nanobind.h>

#if !defined(_WIN32)
#include <unistd.h>

#include <cxxabi.h>
#endif

namespace tandem::python {

/// Calls what may wait for the interpreter's lock, or run Python. Once the interpreter has ended, a daemon
/// thread that waits for the lock never gets it: until Python 3.13 the thread is ended there by
/// pthread_exit(), which unwinds the stack like an exception, and a destructor or nanobind that stops it ends
/// the process. So such a thread sleeps here until the process ends, as it does from Python 3.14 on. Windows
/// ends the thread without unwinding.
template <typename Call>
auto sleep_once_python_ended(const Call& call) {
#if defined(_WIN32)
  return call();
#else
  try {
    return call();
  } catch (const abi::__forced_unwind&) {
    for (;;) ::pause();
  }
#endif
}

/// Lets other Python threads run while it lives.
class WithoutLock {
 public:
  WithoutLock() : state_(PyEval_SaveThread()) {}
  ~WithoutLock() {
    sleep_once_python_ended([this] { PyEval_RestoreThread(state_); });
  }
  WithoutLock(const WithoutLock&) = delete;
  WithoutLock& operator=(const WithoutLock&) = delete;

 private:
  PyThreadState* state_;
};

}  // namespace tandem::python
