// How a walk is launched on GPUs of many kinds, and the room that its rule leaves in a warp's stack.
#include "kernels/contact/walk_shape.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <vector>

namespace tandem::gpu {
namespace {

// Shared memory that a thread block can have: without asking for more, on an RTX 30 to 50, an A100, a Hopper.
constexpr std::uint32_t kSharedBytes[] = {49'152, 101'376, 166'912, 232'448};

TEST(WalkShape, FitsEveryTreeIntoEveryGpu) {
  for (const std::uint32_t shared_bytes : kSharedBytes) {
    for (const std::uint32_t processors : {1u, 20u, 108u, 132u, 170u, 171u, 188u, 341u, 342u, 2000u}) {
      const DeviceLimits limits = {shared_bytes, processors, true};
      for (std::uint32_t depth = 1; depth <= kMaxDepth; ++depth) {
        for (const std::uint32_t most_blocks : {0u, 1u, 16u, 5000u}) {
          const WalkShape shape = walk_shape(limits, depth, most_blocks);
          SCOPED_TRACE(testing::Message() << shared_bytes << " bytes, " << processors << " processors, depth "
                                          << depth << ", " << most_blocks << " blocks");
          ASSERT_LE(shape.shared_bytes(), most_shared_bytes(limits));
          ASSERT_LE(most_shared_bytes(limits), shared_bytes);
          ASSERT_GE(shape.stack_size, 2 * depth + 32 + kFewestEntries);
          ASSERT_GE(shape.warps, 9u);
          ASSERT_EQ(shape.shares, depth > 2);
          ASSERT_LE(shape.warps, 16u);
          ASSERT_GE(shape.blocks, 1u);
          ASSERT_LE(shape.blocks, most_blocks == 0 ? processors : std::min(most_blocks, processors));
          ASSERT_LE(shape.warps * shape.blocks, kMostWarps);
          ASSERT_GE(shape.mailboxes(), kMostGifts * shape.warps * shape.blocks);
          ASSERT_GE(shape.mailboxes(), 256u);
          ASSERT_LE(shape.mailboxes(), most_mailboxes(limits));
        }
      }
    }
  }
}

TEST(WalkShape, GivesUpEntriesFirstAndThenWarps) {
  const auto shape = [](std::uint32_t shared_bytes, std::uint32_t depth) {
    return walk_shape({shared_bytes, 100, true}, depth, 0);
  };
  for (std::uint32_t depth = 1; depth <= kMaxDepth; ++depth) {
    for (const std::uint32_t plenty : {166'912u, 232'448u}) {
      EXPECT_EQ(shape(plenty, depth).warps, 16u);
      EXPECT_EQ(shape(plenty, depth).stack_size, 2 * depth + 32 + kEntries);
    }
    EXPECT_EQ(shape(101'376, depth).warps, 16u);
    EXPECT_EQ(shape(101'376, depth).stack_size, std::min(2 * depth + 32 + kEntries, 310u));
  }
  EXPECT_EQ(shape(49'152, 1).warps, 15u);
  EXPECT_EQ(shape(49'152, kMaxDepth).warps, 9u);
}

TEST(WalkShape, TakesAllMultiprocessorsUpTo341) {
  for (const std::uint32_t processors : {1u, 46u, 170u, 188u, 341u}) {
    EXPECT_EQ(walk_shape({232'448, processors, true}, 10, 0).blocks, processors);
  }
  EXPECT_EQ(walk_shape({232'448, 400, true}, 10, 0).blocks, 341u);
  EXPECT_EQ(walk_shape({232'448, 132, true}, 10, 7).blocks, 7u);
  EXPECT_EQ(most_mailboxes({232'448, 170, true}), 8192u);
  EXPECT_EQ(most_mailboxes({232'448, 171, true}), 16384u);
}

/// A block pair that was tested, by its level, and the bits that it has left.
struct Entry {
  std::uint32_t level, bits;
};

/// A test of a block pair of some level leaves this: an entry, of leaf blocks or not, or nothing with 0 bits.
struct Left {
  bool of_leaves;
  std::uint32_t bits;
};
using BoxTest = std::function<Left(std::uint32_t level, bool may_go_on)>;

/// The stack of a warp, as walk_stack.cuh and walk.cuh have it, but for what its entries are.
class StackModel {
 public:
  StackModel(std::uint32_t depth, std::uint32_t reserve, std::uint32_t entries, BoxTest test)
      : levels_(2 * depth), reserve_(reserve), size_(reserve + entries), test_(std::move(test)) {}

  /// The walk of so many object pairs, and of gifts received. Result: the most entries that it ever had room
  /// for.
  std::uint32_t run(std::uint32_t object_pairs, std::uint32_t gifts, std::mt19937& random) {
    std::uint32_t most = 0;
    for (int step = 0; step < 30'000; ++step) {
      while (count(leaf_pairs_) >= 32) take_newest(leaf_pairs_, 32);
      if (room() < reserve_ + kRoomForOldest) base_ = 0;
      for (; count(stack_) < 32 && object_pairs != 0; --object_pairs) {
        for (int i = 0; i < 16; ++i) stack_.push_back({1, 1});
        most = std::max(most, height());
      }
      if (stack_.empty() && gifts != 0) {
        base_ = 0;
        for (int i = 0; i < 32; ++i)
          stack_.push_back({1 + static_cast<std::uint32_t>(random()) % (levels_ - 1), 16});
        --gifts;
      }
      if (stack_.empty()) break;
      const bool oldest = object_pairs == 0 && has_room_for_oldest(room(), reserve_);
      const std::uint32_t bits = block_pairs_to_take(count(stack_), room(), reserve_);
      for (const std::uint32_t level : oldest ? take_oldest(bits) : take_newest(stack_, bits)) {
        const bool last = level + 1 >= levels_;
        const Left left = test_(level + 1, !last);
        if (left.bits != 0) (left.of_leaves || last ? leaf_pairs_ : stack_).push_back({level + 1, left.bits});
      }
      most = std::max(most, height());
      if (count(stack_) >= 32 && stack_.size() >= 2 && random() % 64 == 0)
        drop_oldest(std::min<std::size_t>(stack_.size() / 2, 32));  // a gift to another warp
    }
    return most;
  }

  std::uint32_t size() const { return size_; }

 private:
  static std::uint32_t count(const std::vector<Entry>& entries) {
    std::uint32_t bits = 0;
    for (const Entry& entry : entries) bits += entry.bits;
    return bits;
  }
  std::uint32_t height() const {
    return base_ + static_cast<std::uint32_t>(stack_.size() + leaf_pairs_.size());
  }
  std::uint32_t room() const { return size_ > height() ? size_ - height() : 0; }

  /// The memory of the oldest entries is not free at once.
  void drop_oldest(std::size_t entries) {
    stack_.erase(stack_.begin(), stack_.begin() + static_cast<std::ptrdiff_t>(entries));
    base_ += static_cast<std::uint32_t>(entries);
  }

  /// Levels of the entries from which the oldest bits come.
  std::vector<std::uint32_t> take_oldest(std::uint32_t bits) {
    std::vector<std::uint32_t> levels;
    std::size_t emptied = 0;
    for (; bits != 0; --bits) {
      levels.push_back(stack_[emptied].level);
      if (--stack_[emptied].bits == 0) ++emptied;
    }
    drop_oldest(emptied);
    return levels;
  }

  /// Levels of the entries from which the newest bits come.
  static std::vector<std::uint32_t> take_newest(std::vector<Entry>& entries, std::uint32_t bits) {
    std::vector<std::uint32_t> levels;
    for (; bits != 0; --bits) {
      levels.push_back(entries.back().level);
      if (--entries.back().bits == 0) entries.pop_back();
    }
    return levels;
  }

  std::uint32_t levels_, reserve_, size_;
  std::uint32_t base_ = 0;  // entries of memory before the stack
  BoxTest test_;
  std::vector<Entry> stack_, leaf_pairs_;
};

std::uint32_t most_entries(std::uint32_t depth, std::uint32_t reserve, std::uint32_t entries,
                           const BoxTest& test, std::uint32_t& size) {
  std::mt19937 random(1);
  StackModel stack(depth, reserve, entries, test);
  size = stack.size();
  return stack.run(6, 6, random);
}

/// Whatever tests leave, a stack is high enough: with the fewest entries, with the most, and with just enough
/// for steps that take the oldest.
TEST(WalkShape, StacksNeverOverflow) {
  std::mt19937 random(2);
  const BoxTest everything = [](std::uint32_t, bool) { return Left{false, 16}; };
  const BoxTest one_candidate_each = [&](std::uint32_t, bool goes_on) {
    return Left{!goes_on, goes_on ? 16u : 1u};
  };
  for (const std::uint32_t depth : {1u, 2u, 5u, 12u, 35u, 64u}) {
    std::vector<BoxTest> tests = {everything, one_candidate_each};
    for (const std::uint32_t leaves : {2u, 4u, 30u}) {
      tests.push_back([&, leaves](std::uint32_t, bool) {
        return Left{random() % leaves == 0,
                    random() % 8 == 0 ? 0 : 1 + static_cast<std::uint32_t>(random()) % 16};
      });
      tests.push_back([&, leaves](std::uint32_t, bool) {
        const bool of_leaves = random() % leaves == 0;
        return Left{of_leaves, of_leaves ? 1u : 16u};
      });
    }
    for (const BoxTest& test : tests) {
      for (const std::uint32_t entries : {kFewestEntries, kRoomForOldest + 1, kEntries}) {
        std::uint32_t size = 0;
        EXPECT_LE(most_entries(depth, stack_reserve(depth), entries, test, size), size)
            << "depth " << depth << ", " << entries << " entries";
      }
    }
  }
}

/// A reserve of half as many levels is too small: the test above can fail.
TEST(WalkShape, StacksOverflowWithASmallerReserve) {
  const BoxTest test = [](std::uint32_t, bool goes_on) { return Left{!goes_on, goes_on ? 16u : 1u}; };
  std::uint32_t size = 0;
  EXPECT_GT(most_entries(64, stack_reserve(32), kFewestEntries, test, size), size);
}

}  // namespace
}  // namespace tandem::gpu
