#include <gtest/gtest.h>
#if !defined(_WIN32)
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#endif
#include <fstream>
#include <system_error>
#include <vector>

#include "common/output_file.h"
#include "common/printable.h"
#include "temp_folder.h"

namespace tandem::build {
namespace {

namespace fs = std::filesystem;

class OutputFile : public testing::Test {
 protected:
  static std::vector<std::byte> bytes(std::size_t size) {
    return std::vector<std::byte>(size, std::byte{42});
  }
  static std::string no_such_file() {
#if defined(_WIN32)
    return std::system_category().message(3);  // ERROR_PATH_NOT_FOUND
#else
    return "No such file or directory";
#endif
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

TEST_F(OutputFile, NamesTheReasonOfAFailureAndLeavesNothing) {
  EXPECT_EQ(write_whole_file(folder_, bytes(5)), "is a folder");
  EXPECT_EQ(write_whole_file(folder_ / "missing" / "a", bytes(5)), no_such_file());
  EXPECT_EQ(files(), 0u);
}

TEST_F(OutputFile, TryingTellsWhatWritingWouldAndChangesNothing) {
  EXPECT_EQ(try_whole_file(folder_ / "a"), "");
  EXPECT_EQ(try_whole_file(folder_), "is a folder");
  EXPECT_EQ(try_whole_file(folder_ / "missing" / "a"), no_such_file());
  EXPECT_EQ(files(), 0u);
  std::ofstream(folder_ / "a") << "old";
  EXPECT_EQ(try_whole_file(folder_ / "a"), "");
  EXPECT_EQ(fs::file_size(folder_ / "a"), 3u);
  EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFile, ReplacesWhatWasThere) {
  std::ofstream(folder_ / "a") << "old";
  EXPECT_EQ(write_whole_file(folder_ / "a", bytes(5)), "");
  EXPECT_EQ(fs::file_size(folder_ / "a"), 5u);
  EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFile, HasANameOfAnyLetters) {
  const fs::path path = folder_ / u8"K\u00fche \u725b \U0001F404.bvh";
  EXPECT_EQ(write_whole_file(path, bytes(5)), "");
  EXPECT_EQ(fs::file_size(path), 5u);
}

// tests/platforms/windows_test.py has a full disk and Ctrl-C of Windows.
#if !defined(_WIN32)
TEST_F(OutputFile, ReplacesWhatWasThereAndKeepsItsPermissions) {
  std::ofstream(folder_ / "a") << "old";
  fs::permissions(folder_ / "a", fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(write_whole_file(folder_ / "a", bytes(5)), "");
  EXPECT_EQ(fs::file_size(folder_ / "a"), 5u);
  EXPECT_EQ(fs::status(folder_ / "a").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(OutputFile, FollowsALinkToAFileOrToNothingAndKeepsIt) {
  for (const bool exists : {true, false}) {
    SCOPED_TRACE(exists ? "a file" : "nothing");
    const fs::path target = folder_ / (exists ? "target" : "none"),
                   link = folder_ / (exists ? "link" : "broken");
    if (exists) std::ofstream(target) << "old";
    fs::create_symlink(exists ? target : target.filename(), link);
    EXPECT_EQ(write_whole_file(link, bytes(7)), "");
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_EQ(fs::file_size(target), 7u);
  }
}

TEST_F(OutputFile, AFullDeviceIsAFailureAndStaysADevice) {
  EXPECT_EQ(write_whole_file("/dev/full", bytes(5)), "No space left on device");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  EXPECT_EQ(write_whole_file("/dev/null", bytes(5)), "");
  EXPECT_EQ(try_whole_file("/dev/null"), "");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
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
#endif

using namespace std::string_view_literals;

TEST(Printable, LeavesUtf8AsItIsAndReplacesTheRestAndControlCharacters) {
  for (const auto& [text, printed, what] :
       {std::tuple{"K\u00fche \u725b \U0001F404"sv, "K\u00fche \u725b \U0001F404", "UTF-8"},
        {"K\xFChe"sv, "K\uFFFDhe", "Latin-1"},
        {"\xC0\xAF"sv, "\uFFFD\uFFFD", "overlong"},
        {"\xED\xA0\x80"sv, "\uFFFD\uFFFD\uFFFD", "a surrogate"},
        {"\xF4\x90\x80\x80"sv, "\uFFFD\uFFFD\uFFFD\uFFFD", "past U+10FFFF"},
        {"cut \xE7\x89"sv, "cut \uFFFD\uFFFD", "a cut character"},
        {"a\0b\x1B[31m\x7F"sv, "a\uFFFDb\uFFFD[31m\uFFFD", "control characters"}})
    EXPECT_EQ(printable(text, 100), printed) << what;
}

TEST(Printable, CutsLongTextBetweenCharacters) {
  EXPECT_EQ(printable("abcdef", 3), "abc...");
  EXPECT_EQ(printable("ab\u725b", 4), "ab...");
  EXPECT_EQ(printable("abc", 3), "abc");
}

}  // namespace
}  // namespace tandem::build
