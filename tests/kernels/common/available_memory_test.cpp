#include "tandem/kernels/detail/available_memory.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace tandem {
namespace {

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

#if defined(__linux__)

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

#endif

TEST(AvailableMemory, IsUnknownWhereNothingTells) {
  EXPECT_EQ(Machine("empty").available(), UINT64_MAX);
}

}  // namespace
}  // namespace tandem
