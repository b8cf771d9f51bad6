// Tests what a query allocates, and what it does when memory or threads are not to be had. This program's own
// malloc() and pthread_create() count and refuse, so it is built without sanitizers, on glibc alone.
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <vector>

#include "kernels/asked.h"
#include "kernels/query_scenes.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/detail/available_memory.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TANDEM_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define TANDEM_SANITIZED 1
#endif
#endif

#if defined(__GLIBC__) && !defined(TANDEM_SANITIZED)
#include <dlfcn.h>

namespace {

std::atomic<long> allocations{0};
/// The allocation that fails, and all after it; negative: none.
std::atomic<long> fails_from{-1};
std::atomic<bool> one_fails_only{false};
/// How many threads may still be started; negative: any.
std::atomic<int> threads_left{-1};

/// Whether this allocation is granted.
bool grant() {
  const long number = allocations.fetch_add(1);
  const long first = fails_from.load();
  return first < 0 || number < first || (one_fails_only && number > first);
}

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t bytes) noexcept {
  return grant() ? __libc_malloc(bytes) : nullptr;
}
void* calloc(std::size_t count, std::size_t bytes) noexcept {
  return grant() ? __libc_calloc(count, bytes) : nullptr;
}
void* realloc(void* old, std::size_t bytes) noexcept {
  return grant() ? __libc_realloc(old, bytes) : nullptr;
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  return grant() ? __libc_memalign(alignment, bytes) : nullptr;
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*),
                   void* argument) noexcept {
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto create = reinterpret_cast<Create>(dlsym(RTLD_NEXT, "pthread_create"));
  if (threads_left == 0) return EAGAIN;
  if (threads_left > 0) --threads_left;
  return create(thread, attributes, start, argument);
}
}

namespace {
/// The machine is said to have so many bytes.
std::atomic<std::uint64_t> memory_of_machine{UINT64_MAX};
}  // namespace

namespace tandem {

/// Instead of the library's.
std::uint64_t available_memory() {
  return memory_of_machine;
}

namespace {

using test::BodyScene;
using test::RandomPoses;

BodyScene crowd() {
  RandomPoses random(1);
  BodyScene scene;
  scene.assets.add(test::soup(random, 40, 0.5));
  scene.assets.add(test::cube(0.5f, 2));
  for (std::uint32_t i = 0; i < 40; ++i) {
    Pose pose = any_rotation(random);
    for (double& x : pose.translation) x = random.symmetric(2);
    scene.instances.push_back({i % 2, pose});
  }
  // A row of touching cubes, so that several workers find pairs.
  for (std::uint32_t i = 0; i < 300; ++i) {
    scene.instances.push_back({1, kIdentityPose});
    scene.instances.back().pose.translation[0] = 10 + i;
  }
  return scene;
}

/// The allocations of one call.
long allocations_of(test::Asked<ContactQuery>& query, const BodyScene& scene, const ContactOptions& options) {
  const long before = allocations;
  EXPECT_EQ(query.find(scene.instances, options), Status::kOk);
  return allocations - before;
}

TEST(QueryMemory, IsCounted) {
  const long before = allocations;
  std::free(std::malloc(3));
  delete new int;
  std::free(std::aligned_alloc(128, 128));
  EXPECT_GE(allocations - before, 2);
}

TEST(QueryMemory, IsNotAllocatedInASteadyState) {
  const BodyScene scene = crowd();
  for (const std::uint32_t threads : {1u, 3u}) {
    for (const ContactOptions& options :
         {ContactOptions{}, {.self_pairs = true}, {.self_pairs = true, .leave_out_rings = 2}}) {
      test::Asked<ContactQuery> query;
      ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
      EXPECT_EQ(query.scene.set_threads(threads), Status::kOk);
      EXPECT_GT(allocations_of(query, scene, options), 0);
      allocations_of(query, scene, options);
      for (int i = 0; i < 30; ++i)
        EXPECT_EQ(allocations_of(query, scene, options), 0) << threads << ", call " << i;
      EXPECT_GT(query.rows().size(), 1000u);
    }
  }
}

/// Refuses memory from the n-th allocation on, or the n-th alone, for every n that a query comes to.
TEST(QueryMemory, WhereItEndsIsSaidAndForgotten) {
  const BodyScene scene = crowd();
  test::Asked<ContactQuery> whole;
  ASSERT_EQ(whole.set_assets(scene.assets.views()), Status::kOk);
  const ContactOptions options = {.self_pairs = true, .leave_out_rings = 2};
  ASSERT_EQ(whole.find(scene.instances, options), Status::kOk);
  for (const std::uint32_t threads : {1u, 3u}) {
    for (const bool once : {false, true}) {
      bool failed = true;
      for (long n = 0; failed; ++n) {
        ASSERT_LT(n, 1000);
        failed = false;
        one_fails_only = once;
        fails_from = allocations + n;
        Status assets_set = Status::kOutOfMemory, found = Status::kOutOfMemory;
        bool threw = false, nothing = false;
        test::Asked<ContactQuery> query;
        try {
          assets_set = query.scene.set_threads(threads);
          if (assets_set == Status::kOk) assets_set = query.set_assets(scene.assets.views());
          if (assets_set == Status::kOk) found = query.find(scene.instances, options);
        } catch (...) {
          threw = true;
        }
        fails_from = -1;
        nothing = query.rows().empty() && query.pairs().empty();
        failed = threw || assets_set != Status::kOk || found != Status::kOk;
        EXPECT_FALSE(threw) << "threads " << threads << ", allocation " << n;
        if (failed && !threw) {
          EXPECT_TRUE(assets_set == Status::kOutOfMemory || found == Status::kOutOfMemory ||
                      found == Status::kCannotStartThread)
              << name(found) << ", threads " << threads << ", allocation " << n;
          EXPECT_TRUE(nothing) << "threads " << threads << ", allocation " << n;
        }
        ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
        ASSERT_EQ(query.find(scene.instances, options), Status::kOk) << threads << ", allocation " << n;
        EXPECT_TRUE(
            std::equal(query.rows().begin(), query.rows().end(), whole.rows().begin(), whole.rows().end()));
      }
    }
  }
}

/// Every triangle of two copies of a mesh is a candidate of every other. Linux would grant the memory for
/// their contacts, and kill the program when it is written to.
TEST(QueryMemory, ThatTheMachineDoesNotHaveIsNotTaken) {
  RandomPoses random(2);
  BodyScene scene;
  scene.assets.add(test::soup(random, 3000, 2));
  for (int i = 0; i < 4; ++i) scene.instances.push_back({0, kIdentityPose});
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  for (const std::uint32_t threads : {1u, 3u}) {
    EXPECT_EQ(query.scene.set_threads(threads), Status::kOk);
    const ContactOptions options = {.mode = QueryMode::boxes};
    memory_of_machine = std::uint64_t{70} << 20;
    EXPECT_EQ(query.find(scene.instances, options), Status::kOutOfMemory) << threads;
    EXPECT_TRUE(query.rows().empty());
    memory_of_machine = UINT64_MAX;
    ASSERT_EQ(query.find(scene.instances, options), Status::kOk) << threads;
    EXPECT_GT(query.rows().size_bytes(), std::size_t{100} << 20);
    query = {};
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  }
}

TEST(QueryThreads, ThatCannotBeStartedAreNamed) {
  const BodyScene scene = crowd();
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(query.scene.set_threads(4), Status::kOk);
  for (int left = 0; left < 3; ++left) {
    threads_left = left;
    const Status status = query.find(scene.instances);
    threads_left = -1;
    EXPECT_EQ(status, Status::kCannotStartThread);
    EXPECT_TRUE(query.rows().empty());
    EXPECT_TRUE(query.pairs().empty());
    EXPECT_EQ(query.counters(), ContactCounters{});
  }
  EXPECT_EQ(query.find(scene.instances), Status::kOk);
  EXPECT_FALSE(query.rows().empty());
}

}  // namespace
}  // namespace tandem

#else

TEST(QueryMemory, IsCounted) {
  GTEST_SKIP() << "sanitizers have a malloc of their own";
}

#endif
