#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tandem::test {

/// Words that several threads share, where loads may be old and stores may come late. Each word has a history
/// of writes, in the order of its address. A thread has a view: of each word the oldest write that it may
/// still read. A load takes any write from there on; an atomic operation takes one that no other has taken,
/// and its result follows it at once; a store goes anywhere behind the view, but not between those two. What
/// is released carries the writer's view to those who acquire it. This is the order that CUDA promises for
/// relaxed, release and acquire operations, but for loads that come before the stores that they depend on.
template <std::size_t kWords, std::size_t kThreads>
class WeakMemory {
 public:
  using View = std::array<std::uint16_t, kWords>;
  enum class Order { relaxed, acquire, release };

  struct Write {
    std::uint64_t value = 0;
    View view = {};       // what who acquires it gets
    bool atomic = false;  // follows the write that it has read
  };

  explicit WeakMemory(std::size_t words) : words_(words) {
    for (std::size_t word = 0; word < words; ++word) history_[word] = {{}};
  }

  /// How many writes a load may read, and how many an atomic operation may take or a store follow. One of
  /// them is a choice, from 0.
  std::size_t loads(std::size_t thread, std::size_t word) const {
    return history_[word].size() - views_[thread][word];
  }
  std::size_t changes(std::size_t thread, std::size_t word) const {
    std::size_t count = 0;
    for (std::size_t i = views_[thread][word]; i < history_[word].size(); ++i) count += is_free(word, i);
    return count;
  }

  /// A load that leaves no trace: what the choice holds.
  std::uint64_t peek(std::size_t thread, std::size_t word, std::size_t choice) const {
    return history_[word][views_[thread][word] + choice].value;
  }
  std::uint64_t peek_atomic(std::size_t word, std::size_t choice) const {
    return history_[word][free_place(word, choice)].value;
  }
  /// Whether the thread may read something older than the choice.
  bool is_news(std::size_t choice) const { return choice != 0; }
  bool is_news_to_atomic(std::size_t thread, std::size_t word, std::size_t choice) const {
    return free_place(word, choice) > views_[thread][word];
  }
  /// An atomic operation that leaves the word as it is.
  void see_by_atomic(std::size_t thread, std::size_t word, std::size_t choice) {
    see(thread, word, free_place(word, choice), Order::relaxed);
  }
  std::uint64_t newest(std::size_t word) const { return history_[word].back().value; }

  std::uint64_t load(std::size_t thread, std::size_t word, Order order, std::size_t choice) {
    const std::size_t at = views_[thread][word] + choice;
    see(thread, word, at, order);
    return history_[word][at].value;
  }

  /// Replaces the choice by change(value). Result: the value before.
  template <typename Change>
  std::uint64_t change(std::size_t thread, std::size_t word, Order order, std::size_t choice, Change change) {
    const std::size_t at = free_place(word, choice);
    const std::uint64_t before = history_[word][at].value;
    see(thread, word, at, order);
    View carried = released(thread, order);
    join(carried, history_[word][at].view);  // whoever acquires it gets what the write before released too
    insert(thread, word, at + 1, {change(before), carried, true});
    return before;
  }

  void store(std::size_t thread, std::size_t word, Order order, std::uint64_t value, std::size_t choice) {
    const std::size_t at = free_place(word, choice) + 1;
    insert(thread, word, at, {value, released(thread, order), false});
  }

  /// The thread reads nothing any more.
  void leave(std::size_t thread) { left_[thread] = true; }

  /// Forgets writes that nobody can read any more.
  void forget() {
    for (std::size_t word = 0; word < words_; ++word) {
      std::uint16_t first = static_cast<std::uint16_t>(history_[word].size() - 1);
      for (std::size_t thread = 0; thread < kThreads; ++thread) {
        if (!left_[thread]) first = std::min(first, views_[thread][word]);
      }
      if (first == 0) continue;
      history_[word].erase(history_[word].begin(), history_[word].begin() + first);
      for_each_view([&](View& view) {
        view[word] = static_cast<std::uint16_t>(view[word] - std::min(view[word], first));
      });
    }
  }

  /// Calls add(number) for all that a thread knows, or for all that is in memory.
  template <typename Add>
  void describe_thread(std::size_t thread, Add add) const {
    if (left_[thread]) return;
    for (std::size_t word = 0; word < words_; ++word) add(views_[thread][word]);
  }
  template <typename Add>
  void describe(Add add) const {
    for (std::size_t word = 0; word < words_; ++word) {
      add(history_[word].size());
      for (const Write& write : history_[word]) {
        add(write.value);
        add(write.atomic);
        for (std::size_t i = 0; i < words_; ++i) add(write.view[i]);
      }
    }
  }

 private:
  /// Whether something may follow a write at once.
  bool is_free(std::size_t word, std::size_t at) const {
    return at + 1 == history_[word].size() || !history_[word][at + 1].atomic;
  }
  /// Choice 0 is the newest.
  std::size_t free_place(std::size_t word, std::size_t choice) const {
    std::size_t at = history_[word].size() - 1;
    for (;; --at) {
      if (is_free(word, at) && choice-- == 0) return at;
    }
  }

  static void join(View& into, const View& other) {
    for (std::size_t i = 0; i < kWords; ++i) into[i] = std::max(into[i], other[i]);
  }
  View released(std::size_t thread, Order order) const {
    return order == Order::release ? views_[thread] : View{};
  }
  void see(std::size_t thread, std::size_t word, std::size_t at, Order order) {
    views_[thread][word] = std::max(views_[thread][word], static_cast<std::uint16_t>(at));
    if (order == Order::acquire) join(views_[thread], history_[word][at].view);
  }
  template <typename Of>
  void for_each_view(Of of) {
    for (View& view : views_) of(view);
    for (std::size_t word = 0; word < words_; ++word) {
      for (Write& write : history_[word]) of(write.view);
    }
  }
  void insert(std::size_t thread, std::size_t word, std::size_t at, const Write& write) {
    const bool between = at < history_[word].size();
    history_[word].insert(history_[word].begin() + static_cast<std::ptrdiff_t>(at), write);
    if (between)
      for_each_view(
          [&](View& view) { view[word] = static_cast<std::uint16_t>(view[word] + (view[word] >= at)); });
    views_[thread][word] = static_cast<std::uint16_t>(at);
    Write& written = history_[word][at];
    written.view[word] = std::max(written.view[word], static_cast<std::uint16_t>(at));
  }

  std::size_t words_;
  std::array<std::vector<Write>, kWords> history_;
  std::array<View, kThreads> views_ = {};
  std::array<bool, kThreads> left_ = {};
};

}  // namespace tandem::test
