#pragma once
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <utility>

#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/scene.h"

namespace tandem {

/// The memory that a question keeps from call to call on a device that answers it in place of the CPU.
struct DeviceMemory : Allocated {
  std::uint64_t assets_id = 0;  ///< that of the scene's assets
  virtual ~DeviceMemory() = default;
};

/// The members of an answer that a device fills; `pairs` are those that it is asked about.
template <typename Row, typename Counters>
struct DeviceAnswer {
  Buffer<ObjectPair>& pairs;
  Buffer<Row>& rows;
  Counters& counters;
  std::unique_ptr<DeviceMemory>& memory;
};

/// The answer to a question: the object pairs that it was about, rows, and counters. All are valid until the
/// question is asked again. After an error there is nothing.
template <typename Row, typename Counters>
class Answer {
 public:
  /// The object pairs: a < b, or a = b for self pairs, sorted, where the scene found them; as given else.
  std::span<const ObjectPair> pairs() const { return pairs_.view(); }

  std::span<const Row> rows() const { return rows_.view(); }

  /// Returns what was counted on the way. Counters depend neither on the number of threads nor on the
  /// machine.
  const Counters& counters() const { return counters_; }

  /// Returns what the device of this scene has of the rows, for questions about them; null where the CPU
  /// found them.
  const DeviceMemory* on_device_of(const SceneState& scene) const;

 protected:
  Status forget(Status status) {
    pairs_.clear();
    rows_.clear();
    counters_ = {};
    memory_on_device_.reset();
    return status;
  }

  /// Has find(state of the scene) make a new answer. Result: what it returns; nothing is left after an error.
  template <typename Find>
  Status ask_scene(Scene& scene, const Find& find) {
    SceneState* const state = scene.state();
    if (state == nullptr) return forget(Status::kOutOfMemory);
    const Status status = find(*state);
    return status == Status::kOk ? status : forget(status);
  }

  DeviceAnswer<Row, Counters> found() { return {pairs_, rows_, counters_, memory_on_device_}; }

  Buffer<ObjectPair> pairs_;
  Buffer<Row> rows_;
  Counters counters_;
  std::unique_ptr<DeviceMemory> memory_on_device_;
};

/// Owns a question's memory, which is made when it is first asked and kept from call to call. Movable, not
/// copyable. Only provide() needs to know what the memory is, so that headers need not.
template <typename Memory>
class Kept {
 public:
  Kept() = default;
  Kept(Kept&& other) noexcept { *this = std::move(other); }
  Kept& operator=(Kept&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(delete_, other.delete_);
    return *this;
  }
  ~Kept() {
    if (memory_ != nullptr) delete_(memory_);
  }

  Memory* get() const { return memory_; }

  /// Makes the memory where there is none. Result: the memory, or null.
  Memory* provide() {
    if (memory_ == nullptr) {
      memory_ = new (std::nothrow) Memory;
      delete_ = [](Memory* memory) { delete memory; };
    }
    return memory_;
  }

 private:
  Memory* memory_ = nullptr;
  void (*delete_)(Memory*) = nullptr;
};

/// A question about the object pairs of a scene: those that the scene finds, or those that the caller gives.
/// `Of` is the question, which has answer(scene, given pairs or null, options).
template <typename Of, typename Row, typename Counters, typename OptionsOf>
class PairQuestion : public Answer<Row, Counters> {
 public:
  using Options = OptionsOf;

  /// Asks about the pairs that the scene finds.
  Status find(Scene& scene, const Options& options = {}) { return ask(scene, nullptr, options); }

  /// Asks about the given object pairs, in either order of a and b; the filter is not asked. They may be
  /// those of this or another question, or a part of them. Result: also kUnknownInstance, where where() of
  /// the scene is the pair.
  Status find(Scene& scene, std::span<const ObjectPair> pairs, const Options& options) {
    return ask(scene, &pairs, options);
  }

 private:
  Status ask(Scene& scene, const std::span<const ObjectPair>* given, const Options& options) {
    const auto find = [&](SceneState& state) {
      return static_cast<Of*>(this)->answer(state, given, options);
    };
    return this->ask_scene(scene, find);
  }
};

}  // namespace tandem
