#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <mutex>

/// Work that threads share where there are some to spare: loops, reductions, sorting, and recursion by
/// invoke(). It may be nested. Threads are started for a piece of work and end with it, some 20 us each, so a
/// piece should take a millisecond. What is thrown in a piece is thrown again where the work was asked for;
/// of several exceptions, any one.
namespace tandem::parallel {

/// Returns how many threads the process may use, at least 1.
unsigned usable_threads();

/// While it lives, at most so many threads, this one included, are at work at a time on what this thread
/// asks for; 0: no limit beside the one that is in force, of the whole process usable_threads().
/// Condition: ends on the thread that made it, the last one made first.
class ThreadLimit {
 public:
  explicit ThreadLimit(unsigned threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  std::atomic<std::size_t> spare_;
  std::atomic<std::size_t>* before_;
};

/// Calls work(context) on this thread, and on up to most - 1 others at the same time, as far as there are
/// some to spare; returns when all have returned. Condition: most > 0.
void run_together(std::size_t most, void (*work)(void* context), void* context);

/// Calls part(local, begin, end) for parts of [0, count) of `grain` each, the last of which may be shorter;
/// which thread takes which part is chance. local: what make() returned on a thread that takes parts, after
/// the last of which it calls done(local), one thread at a time.
template <typename Make, typename Part, typename Done>
void for_parts(std::size_t count, std::size_t grain, const Make& make, const Part& part, const Done& done) {
  if (count == 0) return;
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  const auto take_parts = [&] {
    std::size_t begin = next.fetch_add(grain, std::memory_order_relaxed);
    if (begin >= count) return;
    auto local = make();
    for (; begin < count; begin = next.fetch_add(grain, std::memory_order_relaxed))
      part(local, begin, std::min(count, begin + grain));
    const std::lock_guard lock(mutex);
    done(local);
  };
  using Work = decltype(take_parts);
  run_together((count - 1) / grain + 1, [](void* work) { (*static_cast<const Work*>(work))(); },
               const_cast<void*>(static_cast<const void*>(&take_parts)));
}

/// Calls part(begin, end).
template <typename Part>
void for_parts(std::size_t count, std::size_t grain, const Part& part) {
  const auto nothing = [](auto&&...) { return 0; };
  for_parts(
      count, grain, nothing, [&](int, std::size_t begin, std::size_t end) { part(begin, end); }, nothing);
}

/// Calls body(i) for each i in [0, count).
template <typename Body>
void for_each(std::size_t count, const Body& body) {
  for_parts(count, 1, [&](std::size_t i, std::size_t) { body(i); });
}

/// Calls body(local, i) for each i in [0, count), with a `local` that make() returned for the thread.
template <typename Make, typename Body>
void for_each(std::size_t count, const Make& make, const Body& body) {
  for_parts(
      count, 1, make, [&](auto& local, std::size_t i, std::size_t) { body(local, i); }, [](const auto&) {});
}

/// Adds up what part(sum, begin, end) adds to `sum` of parts of [0, count), by add(sum, other). The order
/// differs from run to run, so that add() must give the same in any.
template <typename Sum, typename Part, typename Add>
Sum reduce(std::size_t count, std::size_t grain, const Sum& zero, const Part& part, const Add& add) {
  Sum total = zero;
  for_parts(
      count, grain, [&] { return zero; }, part, [&](const Sum& sum) { add(total, sum); });
  return total;
}

/// Calls first() and second().
template <typename First, typename Second>
void invoke(const First& first, const Second& second) {
  for_each(2, [&](std::size_t i) { i == 0 ? first() : second(); });
}

/// Calls first() and second() on this thread where it is not worth_while to share them.
template <typename First, typename Second>
void invoke_if(bool worth_while, const First& first, const Second& second) {
  if (worth_while) return invoke(first, second);
  first();
  second();
}

/// Sorts by <. Ranges of up to `grain` are sorted by one thread.
template <typename Iterator>
void sort(Iterator begin, Iterator end, std::ptrdiff_t grain) {
  if (end - begin <= grain) return std::sort(begin, end);
  const Iterator middle = begin + (end - begin) / 2;
  invoke([&] { sort(begin, middle, grain); }, [&] { sort(middle, end, grain); });
  std::inplace_merge(begin, middle, end);
}

}  // namespace tandem::parallel
