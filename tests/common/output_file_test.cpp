#include "common/output_file.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <vector>

#include "temp_folder.h"

namespace tandem::build {
namespace {

namespace fs = std::filesystem;

class OutputFile : public testing::Test {
 protected:
  static std::vector<std::byte> bytes(std::size_t size) {
    return std::vector<std::byte>(size, std::byte{42});
  }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }

  test::TempFolder temporary_;
  fs::path folder_ = temporary_.path();
};

TEST_F(OutputFile, WritesAllBytesAndLeavesNothingElse) {
  EXPECT_EQ(write_whole_file(folder_ / "a b.bvh", bytes(100000)), "");
  EXPECT_EQ(fs::file_size(folder_ / "a b.bvh"), 100000u);
  EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFile, ReplacesWhatWasThere) {
  std::ofstream(folder_ / "a") << "old";
  EXPECT_EQ(write_whole_file(folder_ / "a", bytes(5)), "");
  EXPECT_EQ(fs::file_size(folder_ / "a"), 5u);
}

TEST_F(OutputFile, KeepsASymbolicLink) {
  std::ofstream(folder_ / "target") << "old";
  fs::create_symlink(folder_ / "target", folder_ / "link");
  EXPECT_EQ(write_whole_file(folder_ / "link", bytes(7)), "");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(fs::file_size(folder_ / "target"), 7u);
}

TEST_F(OutputFile, FollowsALinkToNothing) {
  fs::create_symlink("target", folder_ / "link");
  EXPECT_EQ(write_whole_file(folder_ / "link", bytes(7)), "");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(fs::file_size(folder_ / "target"), 7u);
}

TEST_F(OutputFile, KeepsThePermissionsOfAFileThatItReplaces) {
  std::ofstream(folder_ / "a") << "old";
  fs::permissions(folder_ / "a", fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(write_whole_file(folder_ / "a", bytes(5)), "");
  EXPECT_EQ(fs::status(folder_ / "a").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(OutputFile, NamesTheReasonOfAFailureAndLeavesNothing) {
  EXPECT_EQ(write_whole_file(folder_, bytes(5)), "is a folder");
  EXPECT_EQ(write_whole_file(folder_ / "missing" / "a", bytes(5)), "No such file or directory");
  EXPECT_EQ(files(), 0u);
}

TEST_F(OutputFile, AFullDeviceIsAFailureAndStaysADevice) {
  EXPECT_EQ(write_whole_file("/dev/full", bytes(5)), "No space left on device");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  EXPECT_EQ(write_whole_file("/dev/null", bytes(5)), "");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(OutputFile, TryingTellsWhatWritingWouldAndChangesNothing) {
  EXPECT_EQ(try_whole_file(folder_ / "a"), "");
  EXPECT_EQ(try_whole_file(folder_), "is a folder");
  EXPECT_EQ(try_whole_file(folder_ / "missing" / "a"), "No such file or directory");
  EXPECT_EQ(files(), 0u);
  std::ofstream(folder_ / "a") << "old";
  EXPECT_EQ(try_whole_file(folder_ / "a"), "");
  EXPECT_EQ(fs::file_size(folder_ / "a"), 3u);
  EXPECT_EQ(files(), 1u);
  EXPECT_EQ(try_whole_file("/dev/null"), "");
}

// A child writes for ever; the signal must take its temporary file along.
TEST_F(OutputFile, ASignalRemovesTheTemporaryFile) {
  const pid_t child = ::fork();
  if (child == 0) {
    const auto large = bytes(200 << 20);
    for (;;) static_cast<void>(write_whole_file(folder_ / "a", large));
  }
  while (files() == 0) ::usleep(1000);
  ::kill(child, SIGTERM);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM);
  for (const auto& entry : fs::directory_iterator(folder_)) EXPECT_EQ(entry.path().filename(), "a");
}

}  // namespace
}  // namespace tandem::build
