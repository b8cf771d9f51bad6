#include "parallel/parallel.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <numeric>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

namespace tandem::parallel {
namespace {

constexpr unsigned kLimits[] = {1, 2, 3, 8};

TEST(Parallel, TakesEveryPartOnce) {
  for (const unsigned limit : kLimits) {
    const ThreadLimit threads(limit);
    for (const std::size_t count : {0, 1, 2, 7, 8, 9, 1000}) {
      for (const std::size_t grain : {1, 3, 8, 2000}) {
        std::vector<std::atomic<int>> taken(count);
        for_parts(count, grain, [&](std::size_t begin, std::size_t end) {
          EXPECT_EQ(begin % grain, 0u);
          EXPECT_EQ(end, std::min(count, begin + grain));
          for (std::size_t i = begin; i < end; ++i) ++taken[i];
        });
        for (const std::atomic<int>& times : taken) EXPECT_EQ(times, 1);
      }
    }
  }
}

// How many threads are at work, and the most that ever were.
struct Watch {
  std::atomic<int> now = 0, most = 0;

  void work() {
    const int others = now++;
    for (int before = most; before <= others && !most.compare_exchange_weak(before, others + 1);) {
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    --now;
  }
};

void recurse(Watch& watch, int depth) {
  watch.work();
  if (depth > 0) invoke([&] { recurse(watch, depth - 1); }, [&] { recurse(watch, depth - 2); });
}

TEST(Parallel, HasNoMoreThreadsAtWorkThanItMay) {
  for (const int limit : {1, 2, 5}) {
    const ThreadLimit threads(static_cast<unsigned>(limit));
    Watch recursion, loops;
    recurse(recursion, 9);
    EXPECT_LE(recursion.most, limit);
    for_each(3, [&](std::size_t) { for_each(20, [&](std::size_t) { loops.work(); }); });
    EXPECT_LE(loops.most, limit);
  }
}

// Whether `count` pieces are worked on at the same time: each waits for the others.
bool meet(int count) {
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  std::atomic<int> there = 0;
  for_each(static_cast<std::size_t>(count), [&](std::size_t) {
    ++there;
    while (there < count && std::chrono::steady_clock::now() < patience) std::this_thread::yield();
  });
  return std::chrono::steady_clock::now() < patience;
}

TEST(Parallel, HasAsManyThreadsAtWorkAsItMay) {
  for (const int limit : {1, 2, 5}) {
    const ThreadLimit threads(static_cast<unsigned>(limit));
    EXPECT_TRUE(meet(limit));
    EXPECT_TRUE(meet(limit));  // those of the first time have made room
    invoke([&] { EXPECT_TRUE(meet(std::max(limit - 1, 1))); }, [] {});
  }
}

TEST(Parallel, TheInnermostLimitIsInForce) {
  const ThreadLimit outer(4);
  {
    const ThreadLimit inner(1);
    const std::thread::id here = std::this_thread::get_id();
    for_each(50, [&](std::size_t) { EXPECT_EQ(std::this_thread::get_id(), here); });
  }
  EXPECT_TRUE(meet(4));
}

TEST(Parallel, EachThreadHasItsLocalAndIsAskedForItAtTheEnd) {
  for (const unsigned limit : kLimits) {
    const ThreadLimit threads(limit);
    std::atomic<unsigned> made = 0;
    unsigned done = 0;
    std::vector<std::size_t> parts;
    const auto make = [&] {
      ++made;
      return std::vector<std::size_t>();
    };
    for_parts(
        100, 1, make, [](auto& local, std::size_t begin, std::size_t) { local.push_back(begin); },
        [&](const auto& local) {
          ++done;
          parts.insert(parts.end(), local.begin(), local.end());
        });
    EXPECT_EQ(made, done);
    EXPECT_LE(made, limit);
    std::sort(parts.begin(), parts.end());
    std::vector<std::size_t> all(100);
    std::iota(all.begin(), all.end(), 0u);
    EXPECT_EQ(parts, all);
  }
}

TEST(Parallel, ThrowsAgainWhatWasThrownAndGoesOnWorking) {
  for (const unsigned limit : kLimits) {
    const ThreadLimit threads(limit);
    for (const std::size_t bad : {0, 1, 37, 99}) {
      const auto fail = [&](std::size_t i) {
        if (i == bad) throw std::runtime_error("bad");
        std::this_thread::yield();
      };
      EXPECT_THROW(for_each(100, fail), std::runtime_error);
    }
    EXPECT_THROW(invoke([] {}, [] { throw std::bad_alloc(); }), std::bad_alloc);
    std::atomic<int> count = 0;
    for_each(100, [&](std::size_t) { ++count; });
    EXPECT_EQ(count, 100);
  }
}

TEST(Parallel, AddsUpAndSortsAsOneThreadDoes) {
  std::mt19937 random(1);
  std::vector<std::uint32_t> values(10007);
  for (std::uint32_t& value : values) value = static_cast<std::uint32_t>(random()) % 5000;
  std::vector<std::uint32_t> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  const std::uint64_t expected = std::accumulate(values.begin(), values.end(), std::uint64_t{0});
  for (const unsigned limit : kLimits) {
    const ThreadLimit threads(limit);
    const auto sum = reduce(
        values.size(), 100, std::uint64_t{0},
        [&](std::uint64_t& part, std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) part += values[i];
        },
        [](std::uint64_t& total, std::uint64_t part) { total += part; });
    EXPECT_EQ(sum, expected);
    std::vector<std::uint32_t> mine = values;
    parallel::sort(mine.begin(), mine.end(), 100);
    EXPECT_EQ(mine, sorted);
  }
}

}  // namespace
}  // namespace tandem::parallel
