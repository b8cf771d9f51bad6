#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "tandem/formats/gpu_memory.h"

// The GPU memory of a question. An array is listed by declaring it, together with the room that it belongs
// to; how large it is, when it grows and what it adds to bytes() follow.
namespace tandem::gpu {

class Memory;

/// An array as the list of a question's arrays sees it.
class ListedArray {
 public:
  virtual std::size_t bytes_held() const = 0;
  virtual std::size_t bytes_for(std::uint64_t count) const = 0;  ///< with room for so many
  virtual void give_back() = 0;
  virtual cudaError_t provide(std::uint64_t count) = 0;  ///< for so many of what the room counts
  virtual void name_to(void*) const {}                   ///< writes its place to a kernel's arguments

 protected:
  /// room: null for an array whose size its owner chooses.
  ListedArray(Memory& memory, const void* room);
  ~ListedArray() = default;

 private:
  friend Memory;
  const void* room_;
  ListedArray* next_ = nullptr;
};

/// Has all arrays of a question. It stays where it is, since arrays and rooms point to it.
class Memory {
 public:
  Memory() = default;
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  std::size_t bytes() const {
    std::size_t sum = 0;
    for (const ListedArray* array = first_; array != nullptr; array = array->next_)
      sum += array->bytes_held();
    return sum;
  }

  /// Returns the bytes of a room's arrays for so many of what it counts.
  std::size_t bytes_for(const void* room, std::uint64_t count) const {
    std::size_t sum = 0;
    for (const ListedArray* array = first_; array != nullptr; array = array->next_) {
      if (array->room_ == room) sum += array->bytes_for(count);
    }
    return sum;
  }

  /// Writes to the arguments of a kernel where the arrays lie that these name.
  template <typename Args>
  void name_arrays(Args& args) const {
    for (const ListedArray* array = first_; array != nullptr; array = array->next_) array->name_to(&args);
  }

  void give_back(const void* room) {
    for (ListedArray* array = first_; array != nullptr; array = array->next_) {
      if (array->room_ == room) array->give_back();
    }
  }

  /// Makes the arrays of a room anew. Old and new ones never lie side by side.
  cudaError_t provide(const void* room, std::uint64_t count) {
    give_back(room);
    cudaError_t error = cudaSuccess;
    for (ListedArray* array = first_; array != nullptr && error == cudaSuccess; array = array->next_) {
      if (array->room_ == room) error = array->provide(count);
    }
    return error;
  }

 private:
  friend ListedArray;
  ListedArray *first_ = nullptr, **last_ = &first_;
};

inline ListedArray::ListedArray(Memory& memory, const void* room) : room_(room) {
  *memory.last_ = this;
  memory.last_ = &next_;
}

/// Room for so many of one thing, in arrays that grow together. Functions that make room wait for the device;
/// after an error there is none.
template <typename Number>
class Room {
 public:
  explicit Room(Memory& memory) : memory_(memory) {}

  Memory& memory() const { return memory_; }
  Number count() const { return count_; }
  bool has(Number wanted) const { return is_made_ && wanted <= count_; }
  std::size_t bytes_for(Number wanted) const { return memory_.bytes_for(this, wanted); }

  /// Makes room for exactly `wanted` where there is less.
  cudaError_t fit(Number wanted) {
    if (has(wanted)) return cudaSuccess;
    forget();
    const cudaError_t error = memory_.provide(this, wanted);
    if (error != cudaSuccess) return error;
    count_ = wanted;
    is_made_ = true;
    return error;
  }

  /// Makes room for `wanted` where there is less, and for half as many again as there were at least, so that
  /// repeated growth settles; but for no more than `most`.
  cudaError_t grow(Number wanted, Number most = std::numeric_limits<Number>::max()) {
    if (has(wanted)) return cudaSuccess;
    const std::uint64_t roomy = std::max<std::uint64_t>(wanted, std::uint64_t{count_} + count_ / 2);
    return fit(static_cast<Number>(std::min<std::uint64_t>(roomy, most)));
  }

  void give_back() {
    forget();
    memory_.give_back(this);
  }

  /// Says that there is no room, because something that belongs to it is missing.
  void forget() {
    count_ = 0;
    is_made_ = false;
  }

 private:
  Memory& memory_;
  Number count_ = 0;
  bool is_made_ = false;  // room for nothing may take some memory too
};

/// Returns how many elements an array has for so many of what its room counts.
using ElementsFor = std::uint64_t (*)(std::uint64_t count);
inline std::uint64_t one_for_each(std::uint64_t count) {
  return count;
}
template <std::uint64_t kTimes>
std::uint64_t times(std::uint64_t count) {
  return kTimes * count;
}

/// Says what becomes of an array's elements when its room grows.
enum class Growth { forgets, keeps };

/// An array of a question, in GPU memory.
template <typename Element>
class RoomArray : public GpuArray<Element>, public ListedArray {
 public:
  RoomArray(Memory& memory) : ListedArray(memory, nullptr) {}
  template <typename Number>
  RoomArray(Room<Number>& room, ElementsFor elements = one_for_each, Growth growth = Growth::forgets)
      : ListedArray(room.memory(), &room), elements_(elements), growth_(growth) {}
  using GpuArray<Element>::operator=;

 private:
  std::size_t bytes_held() const override { return this->bytes(); }
  std::size_t bytes_for(std::uint64_t count) const override { return elements_(count) * sizeof(Element); }
  void give_back() override {
    if (growth_ == Growth::forgets) this->free();
  }
  cudaError_t provide(std::uint64_t count) override {
    return growth_ == Growth::keeps ? this->grow(elements_(count), this->room())
                                    : this->reserve(elements_(count));
  }

  ElementsFor elements_ = one_for_each;
  Growth growth_ = Growth::forgets;
};

template <typename Args, typename Element>
Args args_with(Element* Args::*);
template <typename Args, typename Element>
std::remove_const_t<Element> element_of(Element* Args::*);

/// An array that kernels know as this member of their arguments.
template <auto kMember>
class ArgArray : public RoomArray<decltype(element_of(kMember))> {
 public:
  using Base = RoomArray<decltype(element_of(kMember))>;
  using Base::Base;
  using Base::operator=;

 private:
  void name_to(void* args) const override {
    static_cast<decltype(args_with(kMember))*>(args)->*kMember = this->data();
  }
};

}  // namespace tandem::gpu
