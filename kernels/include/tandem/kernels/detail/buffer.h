#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

#include "tandem/formats/allocator.h"
#include "tandem/kernels/detail/available_memory.h"

namespace tandem {

/// Memory that grows and is kept: a vector for code that must not throw. Elements are plain data and start
/// uninitialised. Aligned to kMemoryAlignment, from the current allocator. Movable, not copyable. Out of
/// memory is also where Linux would grant more than there is, see available_memory(); small arrays do not
/// ask.
template <typename Value>
class Buffer {
  static_assert(std::is_trivially_copyable_v<Value>);

 public:
  Buffer() = default;
  Buffer(Buffer&& other) noexcept { *this = std::move(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
    return *this;
  }
  ~Buffer() { deallocate(data_); }

  /// Makes room for `size` elements and forgets what was in it, unless there was room; grows by half at
  /// least where there is memory for that. False: out of memory, nothing changed.
  [[nodiscard]] bool resize(std::size_t size) {
    if (size > capacity_) {
      const std::size_t grown = capacity_ + capacity_ / 2;
      if (!reallocate(size < grown && is_available(grown, 1) ? grown : size, 0, 1)) return false;
    }
    size_ = size;
    return true;
  }

  /// Adds an element; where there is no room, grows as grow() does. False: out of memory, nothing changed.
  [[nodiscard]] bool push(const Value& value, std::size_t owners = 1) {
    if (size_ == capacity_ && !grow(size_, owners)) return false;
    data_[size_++] = value;
    return true;
  }

  /// Makes room for half as many more elements as there is room for, or where memory is scarce an eighth as
  /// many, and keeps the first `kept`. owners: how many threads may be growing such arrays at this time, so
  /// that there is memory for all. False: out of memory, nothing changed.
  [[nodiscard]] bool grow(std::size_t kept, std::size_t owners = 1) {
    const std::size_t half = capacity_ + capacity_ / 2 + 64;
    return reallocate(is_available(half, owners) ? half : capacity_ + capacity_ / 8 + 64, kept, owners);
  }

  void clear() { size_ = 0; }
  Value* data() { return data_; }
  const Value* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t capacity() const { return capacity_; }
  Value& operator[](std::size_t i) { return data_[i]; }
  const Value& operator[](std::size_t i) const { return data_[i]; }
  std::span<const Value> view() const { return {data_, size_}; }

 private:
  static constexpr std::size_t kSmall = std::size_t{64} << 20;  ///< bytes

  static bool is_available(std::size_t capacity, std::size_t owners) {
    const std::size_t bytes = capacity * sizeof(Value);
    return bytes < kSmall || bytes <= available_memory() / 16 * 15 / owners;
  }

  bool reallocate(std::size_t capacity, std::size_t kept, std::size_t owners) {
    if (capacity > SIZE_MAX / 2 / sizeof(Value) || !is_available(capacity, owners)) return false;
    auto* data = static_cast<Value*>(allocate(capacity * sizeof(Value)));
    if (data == nullptr) return false;
    for (std::size_t i = 0; i < kept; ++i) data[i] = data_[i];
    deallocate(data_);
    data_ = data;
    capacity_ = capacity;
    return true;
  }

  Value* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace tandem
