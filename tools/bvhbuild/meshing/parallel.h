#pragma once
/// How the builder shares work between threads: by oneTBB where it was found, else one piece after the other.
/// The results are the same, for whatever is reduced here may be reduced in any order.
#ifdef TANDEM_HAVE_TBB
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/parallel_reduce.h>
#include <oneapi/tbb/parallel_sort.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#else
#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#endif

namespace tandem::build {

#ifdef TANDEM_HAVE_TBB

using oneapi::tbb::blocked_range;
using oneapi::tbb::parallel_for;
using oneapi::tbb::parallel_invoke;
using oneapi::tbb::parallel_reduce;
using oneapi::tbb::parallel_sort;

template <typename Value>
using PerThread = oneapi::tbb::enumerable_thread_specific<Value>;

/// Runs body() with at most so many threads, 0: as many as the machine has, in an arena of its own, so that
/// the program's other work with oneTBB keeps its threads.
template <typename Body>
void run_with_threads(std::size_t threads, const Body& body) {
  using oneapi::tbb::global_control;
  const std::size_t most = global_control::active_value(global_control::max_allowed_parallelism);
  oneapi::tbb::task_arena arena(static_cast<int>(threads != 0 ? std::min(threads, most) : most));
  arena.execute(body);
}

#else

template <typename Index>
class blocked_range {
 public:
  blocked_range(Index begin, Index end, std::size_t /*grain*/ = 1) : begin_(begin), end_(end) {}
  Index begin() const { return begin_; }
  Index end() const { return end_; }

 private:
  Index begin_, end_;
};

template <typename Index, typename Body>
void parallel_for(const blocked_range<Index>& range, const Body& body) {
  if (range.begin() < range.end()) body(range);
}

template <typename Index, typename Body>
void parallel_for(Index begin, Index end, const Body& body) {
  for (Index i = begin; i < end; ++i) body(i);
}

template <typename First, typename Second>
void parallel_invoke(const First& first, const Second& second) {
  first();
  second();
}

template <typename Index, typename Value, typename Body, typename Join>
Value parallel_reduce(const blocked_range<Index>& range, const Value& identity, const Body& body,
                      const Join& /*join*/) {
  return range.begin() < range.end() ? body(range, identity) : identity;
}

template <typename Iterator>
void parallel_sort(Iterator begin, Iterator end) {
  std::sort(begin, end);
}

/// The value of a thread, made when it first asks for it; here there is one thread.
template <typename Value>
class PerThread {
 public:
  template <typename Make>
  explicit PerThread(const Make& make) : make_(make) {}
  Value& local() { return value_ ? *value_ : value_.emplace(make_()); }

 private:
  std::optional<Value> value_;
  std::function<Value()> make_;
};

template <typename Body>
void run_with_threads(std::size_t /*threads*/, const Body& body) {
  body();
}

#endif

}  // namespace tandem::build
