#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

/// A child process tells its parent messages through a pipe. Writer and reader have the same functions, so
/// that what a message holds is listed once.
namespace tandem {

using MessageSink = std::function<void(const void* bytes, std::size_t count)>;

/// Reads exactly `count` bytes; false when there are no more.
using MessageSource = std::function<bool(void* bytes, std::size_t count)>;

class MessageWriter {
 public:
  explicit MessageWriter(const MessageSink& sink) : sink_(sink) {}

  bool number(std::uint64_t value) {
    sink_(&value, sizeof value);
    return true;
  }
  bool flag(bool value) { return number(value); }

  /// The elements of a vector or a string, as they lie in memory.
  template <class Sequence>
  bool sequence(const Sequence& items) {
    number(items.size());
    if (!items.empty()) sink_(items.data(), items.size() * sizeof(items[0]));
    return true;
  }

  /// Items that `write` writes.
  template <class Item, class Write>
  bool list(const std::vector<Item>& items, const Write& write) {
    number(items.size());
    return std::all_of(items.begin(), items.end(), write);
  }

  template <class Item, class Write>
  bool optional(const std::optional<Item>& item, const Write& write) {
    flag(item.has_value());
    return !item || write(*item);
  }

 private:
  const MessageSink& sink_;
};

/// Each function returns false where the message ends before, or promises more than most_bytes in all.
class MessageReader {
 public:
  MessageReader(const MessageSource& source, std::uint64_t most_bytes)
      : source_(source), bytes_left_(most_bytes) {}

  bool number(std::uint64_t& value) { return source_(&value, sizeof value); }
  bool flag(bool& value) {
    std::uint64_t stored = 0;
    if (!number(stored)) return false;
    value = stored != 0;
    return true;
  }

  bool expect(std::uint64_t wanted) {
    std::uint64_t value = 0;
    return number(value) && value == wanted;
  }

  /// Reserved memory is not yet used memory, so an announcement that nothing follows costs address space
  /// alone.
  template <class Sequence>
  bool sequence(Sequence& items) {
    using Item = typename Sequence::value_type;
    std::uint64_t count = 0;
    if (!number(count) || count > bytes_left_ / sizeof(Item)) return false;
    bytes_left_ -= count * sizeof(Item);
    items.clear();
    items.reserve(count);
    constexpr std::uint64_t kAtOnce = std::max<std::uint64_t>(1, (1u << 20) / sizeof(Item));
    while (items.size() < count) {
      const std::size_t before = items.size();
      const std::size_t some = std::min(count - before, kAtOnce);
      items.resize(before + some);
      if (!source_(items.data() + before, some * sizeof(Item))) return false;
    }
    return true;
  }

  template <class Item, class Read>
  bool list(std::vector<Item>& items, const Read& read) {
    std::uint64_t count = 0;
    if (!number(count)) return false;
    for (std::uint64_t i = 0; i < count; ++i) {
      if (bytes_left_ < sizeof(Item)) return false;
      bytes_left_ -= sizeof(Item);
      if (!read(items.emplace_back())) return false;
    }
    return true;
  }

  template <class Item, class Read>
  bool optional(std::optional<Item>& item, const Read& read) {
    bool given = false;
    return flag(given) && (!given || read(item.emplace()));
  }

 private:
  const MessageSource& source_;
  std::uint64_t bytes_left_;
};

}  // namespace tandem
