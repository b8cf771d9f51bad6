#include "kernels/common/worker_threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

namespace tandem {
namespace {

TEST(WorkerThreads, TakeEveryPartOnce) {
  WorkerThreads threads;
  for (const std::uint32_t workers : {1u, 2u, 3u, 16u, 5u}) {
    ASSERT_TRUE(threads.provide(workers));
    for (const std::size_t count : {0, 1, 2, 7, 8, 9, 1000}) {
      for (const std::size_t grain : {1, 3, 8}) {
        std::vector<std::atomic<int>> taken(count);
        threads.for_parts(workers, count, grain,
                          [&](std::size_t begin, std::size_t end, std::uint32_t worker) {
                            EXPECT_LT(worker, workers);
                            EXPECT_LE(end, count);
                            EXPECT_TRUE(workers == 1 || count <= grain || end - begin <= grain);
                            for (std::size_t i = begin; i < end; ++i) ++taken[i];
                          });
        for (const std::atomic<int>& times : taken) EXPECT_EQ(times, 1);
      }
    }
  }
}

/// Work that follows at once, and after the threads fell asleep; each piece sees what the one before wrote.
TEST(WorkerThreads, DoOnePieceOfWorkAfterTheOther) {
  WorkerThreads threads;
  ASSERT_TRUE(threads.provide(4));
  std::vector<std::uint64_t> values[2] = {std::vector<std::uint64_t>(64, 0),
                                          std::vector<std::uint64_t>(64, 0)};
  std::uint64_t pieces = 0;
  for (int round = 0; round < 20; ++round) {
    std::this_thread::sleep_for(std::chrono::milliseconds(round % 5));
    for (int piece = 0; piece < 50; ++piece, ++pieces) {
      const std::uint32_t workers = 2 + piece % 3;
      const std::vector<std::uint64_t>& from = values[piece % 2];
      std::vector<std::uint64_t>& to = values[1 - piece % 2];
      threads.for_parts(workers, to.size(), 1, [&](std::size_t i, std::size_t, std::uint32_t) {
        EXPECT_EQ(from[from.size() - 1 - i], pieces);
        to[i] = pieces + 1;
      });
    }
  }
  EXPECT_EQ(values[0], std::vector<std::uint64_t>(64, pieces));
}

/// The caller sleeps until the others are done.
TEST(WorkerThreads, AreWaitedForWhereTheyWorkLonger) {
  WorkerThreads threads;
  ASSERT_TRUE(threads.provide(3));
  for (int round = 0; round < 5; ++round) {
    std::atomic<int> begun = 0, ended = 0;
    threads.for_parts(3, 3, 1, [&](std::size_t, std::size_t, std::uint32_t worker) {
      ++begun;
      while (worker == 0 && begun < 3) std::this_thread::yield();  // so that others take the two other parts
      if (worker != 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
      ++ended;
    });
    EXPECT_EQ(ended, 3);
  }
}

}  // namespace
}  // namespace tandem
