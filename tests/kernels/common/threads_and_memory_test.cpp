#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "kernels/common/worker_threads.h"
#include "tandem/kernels/detail/available_memory.h"

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

#if defined(__linux__)

/// Files of a made-up machine.
class Machine {
 public:
  explicit Machine(const std::string& name) : root_(testing::TempDir() + "available_memory_" + name) {
    std::filesystem::remove_all(root_);
  }
  ~Machine() { std::filesystem::remove_all(root_); }
  Machine& with(const std::string& path, const std::string& text) {
    const std::filesystem::path file = root_ + path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
    return *this;
  }
  std::uint64_t available() const { return available_memory_under(root_.c_str()); }

 private:
  std::string root_;
};

constexpr const char* kMeminfo = "MemTotal:  9000 kB\nMemFree:  10 kB\nMemAvailable:    8000 kB\n";

TEST(AvailableMemory, IsTheMachinesWhereThereAreNoGroups) {
  EXPECT_EQ(Machine("plain").with("/proc/meminfo", kMeminfo).available(), 8000u * 1024);
}

TEST(AvailableMemory, IsWhatAGroupLeaves) {
  Machine machine("v2");
  machine.with("/proc/meminfo", kMeminfo).with("/proc/self/cgroup", "0::/a/b\n");
  machine.with("/sys/fs/cgroup/a/b/memory.max", "max\n").with("/sys/fs/cgroup/a/b/memory.current", "500\n");
  EXPECT_EQ(machine.available(), 8000u * 1024);
  machine.with("/sys/fs/cgroup/a/memory.max", "70000\n").with("/sys/fs/cgroup/a/memory.current", "60000\n");
  EXPECT_EQ(machine.available(), 10000u);
  machine.with("/sys/fs/cgroup/a/memory.stat", "anon 5\ninactive_file 2500\n");
  EXPECT_EQ(machine.available(), 12500u);
  machine.with("/sys/fs/cgroup/memory.max", "100\n").with("/sys/fs/cgroup/memory.current", "200\n");
  EXPECT_EQ(machine.available(), 0u);
}

TEST(AvailableMemory, IsWhatAGroupOfVersion1Leaves) {
  Machine machine("v1");
  machine.with("/proc/meminfo", kMeminfo).with("/proc/self/cgroup", "9:cpu,cpuacct:/x\n4:memory:/a\n0::/\n");
  machine.with("/sys/fs/cgroup/memory/a/memory.limit_in_bytes", "9000\n");
  machine.with("/sys/fs/cgroup/memory/a/memory.usage_in_bytes", "4000\n");
  machine.with("/sys/fs/cgroup/memory/a/memory.stat", "cache 1\ntotal_inactive_file 1000\n");
  EXPECT_EQ(machine.available(), 6000u);
}

TEST(AvailableMemory, OfThisMachineIsSomethingOrUnknown) {
  EXPECT_GT(available_memory(), std::uint64_t{1} << 20);
}

TEST(AvailableMemory, IsUnknownWhereNothingTells) {
  EXPECT_EQ(Machine("empty").available(), UINT64_MAX);
}

#endif

}  // namespace
}  // namespace tandem
