#include "common/limited_child.h"

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <vector>

namespace tandem::build {
namespace {

using Sink = LimitedChild::Sink;

[[noreturn]] void run_for_ever() {
  for (volatile unsigned spin = 0;;) spin = spin + 1;
}

/// Starts work that is not expected to say anything, and returns how it ended.
ChildEnd end_of(const ChildLimits& limits, const std::function<void(const Sink&)>& work,
                int* signal = nullptr) {
  LimitedChild child;
  EXPECT_EQ(child.start(limits, work), "");
  char byte = 0;
  EXPECT_FALSE(child.read(&byte, 1));
  const ChildEnd end = child.finish();
  if (signal != nullptr) *signal = child.signal();
  return end;
}

TEST(LimitedChild, HandsOverWhatItWrites) {
  LimitedChild child;
  std::vector<int> sent(300000);
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<int>(i * i);
  const auto work = [&](const Sink& sink) { sink(sent.data(), sent.size() * sizeof(int)); };
  ASSERT_EQ(child.start({}, work), "");
  std::vector<int> got(sent.size());
  ASSERT_TRUE(child.read(got.data(), got.size() * sizeof(int)));
  EXPECT_EQ(got, sent);
  char byte = 0;
  EXPECT_FALSE(child.read(&byte, 1));
  EXPECT_EQ(child.finish(), ChildEnd::finished);
}

TEST(LimitedChild, TellsACrashBySignal) {
  int signal = 0;
  EXPECT_EQ(end_of(
                {}, [](const Sink&) { raise(SIGSEGV); }, &signal),
            ChildEnd::crashed);
  EXPECT_EQ(signal, SIGSEGV);
  EXPECT_EQ(end_of(
                {}, [](const Sink&) { std::abort(); }, &signal),
            ChildEnd::crashed);
  EXPECT_EQ(signal, SIGABRT);
}

TEST(LimitedChild, StopsWorkThatDoesNotEnd) {
  EXPECT_EQ(end_of({0.2, 1u << 30}, [](const Sink&) { run_for_ever(); }), ChildEnd::out_of_time);
  EXPECT_EQ(end_of({0.2, 1u << 30}, [](const Sink&) { pause(); }), ChildEnd::out_of_time);
}

TEST(LimitedChild, StopsWorkThatCatchesSignals) {
  const auto stubborn = [](const Sink&) {
    for (int signal = 1; signal < NSIG; ++signal) std::signal(signal, SIG_IGN);
    run_for_ever();
  };
  EXPECT_EQ(end_of({0.2, 1u << 30}, stubborn), ChildEnd::out_of_time);
}

TEST(LimitedChild, TellsAFailedAllocationFromACrash) {
  if (!limits_memory()) GTEST_SKIP() << "sanitizers need the address space that this limits";
  const auto greedy = [](const Sink& sink) {
    std::vector<char> much(std::size_t{256} << 20, 1);
    sink(much.data(), 1);
  };
  EXPECT_EQ(end_of({10, 64u << 20}, greedy), ChildEnd::out_of_memory);
  EXPECT_EQ(end_of({10, 0}, greedy), ChildEnd::out_of_memory);
}

TEST(LimitedChild, TellsAThrownException) {
  EXPECT_EQ(end_of({}, [](const Sink&) { throw std::runtime_error("no"); }), ChildEnd::lost);
}

TEST(LimitedChild, TellsAnEarlyExit) {
  EXPECT_EQ(end_of({}, [](const Sink&) { _exit(77); }), ChildEnd::lost);
}

TEST(LimitedChild, EndsOneThatStillWritesWhenNobodyReads) {
  LimitedChild child;
  const auto talk = [](const Sink& sink) {
    const std::vector<char> much(1 << 20, 'x');
    for (;;) sink(much.data(), much.size());
  };
  ASSERT_EQ(child.start({}, talk), "");
  char byte = 0;
  ASSERT_TRUE(child.read(&byte, 1));
  EXPECT_EQ(child.finish(), ChildEnd::lost);
}

TEST(LimitedChild, WritesNoFile) {
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "limited_child_file";
  std::filesystem::remove(path);
  const auto work = [&](const Sink&) {
    std::FILE* file = std::fopen(path.c_str(), "w");
    if (file == nullptr) _exit(0);
    std::fputs("something", file);
    std::fclose(file);
  };
  int signal = 0;
  EXPECT_EQ(end_of({}, work, &signal), ChildEnd::crashed);
  EXPECT_EQ(signal, SIGXFSZ);
  EXPECT_EQ(std::filesystem::file_size(path), 0u);
  std::filesystem::remove(path);
}

TEST(LimitedChild, IsGoneAfterItsOwner) {
  pid_t pid = 0;
  {
    LimitedChild child;
    const auto work = [](const Sink& sink) {
      const pid_t self = getpid();
      sink(&self, sizeof self);
      run_for_ever();
    };
    ASSERT_EQ(child.start({}, work), "");
    ASSERT_TRUE(child.read(&pid, sizeof pid));
    EXPECT_EQ(kill(pid, 0), 0);
  }
  EXPECT_EQ(kill(pid, 0), -1);
  EXPECT_EQ(errno, ESRCH);
}

/// The owner is killed in the middle of its work, as by Ctrl-C: nobody is left to stop the child but the
/// kernel.
TEST(LimitedChild, DiesWithItsParent) {
  prctl(PR_SET_CHILD_SUBREAPER, 1);  // the orphan becomes ours to wait for
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t owner = fork();
  if (owner == 0) {
    LimitedChild child;
    const auto work = [](const Sink& sink) {
      const pid_t self = getpid();
      sink(&self, sizeof self);
      run_for_ever();
    };
    pid_t pid = 0;
    if (!child.start({}, work).empty() || !child.read(&pid, sizeof pid)) _exit(1);
    if (write(ends[1], &pid, sizeof pid) < 0) _exit(1);
    raise(SIGINT);
    _exit(1);
  }
  pid_t orphan = 0;
  ASSERT_EQ(read(ends[0], &orphan, sizeof orphan), static_cast<ssize_t>(sizeof orphan));
  int status = 0;
  ASSERT_EQ(waitpid(owner, &status, 0), owner);
  EXPECT_TRUE(WIFSIGNALED(status));
  ASSERT_EQ(waitpid(orphan, &status, 0), orphan);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
  close(ends[0]);
  close(ends[1]);
  prctl(PR_SET_CHILD_SUBREAPER, 0);
}

}  // namespace
}  // namespace tandem::build
