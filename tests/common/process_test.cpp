#include "common/process.h"

#include <gtest/gtest.h>
#if defined(_WIN32)
#include <windows.h>
#else
#include <csignal>
#endif

#include "common/exit_code.h"

namespace tandem {
namespace {

// This is what the system does to a process that reads a page of a mapped file whose disk has failed.
void lose_a_page() {
#if defined(_WIN32)
  RaiseException(EXCEPTION_IN_PAGE_ERROR, 0, 0, nullptr);
#else
  std::raise(SIGBUS);
#endif
}

TEST(ProcessDeathTest, TellsThatAMappedFileCannotBeRead) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  const auto lose = [] {
    prepare_process("tool");
    lose_a_page();
  };
  EXPECT_EXIT(lose(), testing::ExitedWithCode(kUnreadableInput),
              "tool: a file was cut short, or its disk failed, while it was read");
}

}  // namespace
}  // namespace tandem
