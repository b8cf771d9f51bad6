#pragma once
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

#include "kernels/common/block_pair.h"
#include "kernels/geometry/local_frame.h"
#include "kernels/points_and_rays/body_tree.h"
#include "kernels/scene/scene_state.h"

// What questions about points and rays share: the bodies in their frames, a tree of their world boxes, and an
// order in which neighbours follow each other.
namespace tandem {

/// Points or rays that a worker takes at a time. What one part finds depends on no other, so that no result
/// depends on the number of threads.
inline constexpr std::size_t kProbesAtOnce = 512;

inline bool is_in_range(const std::array<double, 3>& point) {
  return probe::is_in_range(point.data());
}

/// The bodies of a scene as points and rays see them, kept until one changes.
class ProbedBodies {
 public:
  /// Result: kOk, kOutOfMemory.
  Status make(SceneState& scene);

  const LocalFrame& frame(std::uint32_t body) const { return frames_[body]; }

  /// The box of all bodies; empty where there are none.
  const WorldBox& bounds() const { return bounds_; }

  /// As visit_bodies() does.
  template <typename Bound, typename Visit>
  void visit(const Bound& bound, const double& limit, const Visit& visit) const {
    if (boxes_.tree().items.size() != 0) probe::visit_bodies(Places{boxes_.tree()}, bound, limit, visit);
  }

 private:
  struct Places {
    const BoxTree& tree;
    int top() const { return tree.top(); }
    const BoxTree::Group* level(int i) const { return tree.level(i); }
    std::uint32_t body(std::uint32_t i) const { return tree.items[i].box; }
  };

  std::uint64_t assets_id_ = 0, shapes_id_ = 0, version_ = 0;  // of what this is made
  Buffer<LocalFrame> frames_;
  WorldBox bounds_;
  BroadPhase boxes_;
};

/// Has the machine load what is read soon.
inline void fetch_ahead([[maybe_unused]] const void* data) {
#if defined(__GNUC__)
  __builtin_prefetch(data);
#endif
}

/// Says where things lie that are to be ordered: numbers in the same units in a box.
class ProbeOrder {
 public:
  /// Orders the things 0 to count - 1 so that those follow each other whose places are near each other, by
  /// Morton's order. place(i, out) writes kNumbers numbers of thing i. False: out of memory.
  template <int kNumbers, typename Place>
  [[nodiscard]] bool make(std::size_t count, const Place& place);

  std::uint32_t operator[](std::size_t i) const { return static_cast<std::uint32_t>(keys_[i]); }

  /// The thing whose data are to be fetched when thing i is looked at.
  std::uint32_t ahead(std::size_t i) const { return (*this)[i + kAhead < keys_.size() ? i + kAhead : i]; }

 private:
  bool sort();

  Buffer<std::uint64_t> keys_, other_;  // a key of kKeyBits in the upper half, a number in the lower
  static constexpr int kKeyBits = 30;
  static constexpr std::size_t kAhead = 8;
};

template <int kNumbers, typename Place>
bool ProbeOrder::make(std::size_t count, const Place& place) {
  constexpr int kBits = kKeyBits / kNumbers;
  constexpr double kSteps = std::uint64_t{1} << kBits;
  if (!keys_.resize(count) || !other_.resize(count)) return false;
  double lo[kNumbers], hi[kNumbers], at[kNumbers];
  std::fill_n(lo, kNumbers, HUGE_VAL);
  std::fill_n(hi, kNumbers, -HUGE_VAL);
  for (std::size_t i = 0; i < count; ++i) {
    place(i, at);
    for (int k = 0; k < kNumbers; ++k) {
      lo[k] = at[k] < lo[k] ? at[k] : lo[k];
      hi[k] = at[k] > hi[k] ? at[k] : hi[k];
    }
  }
  double scale[kNumbers];
  for (int k = 0; k < kNumbers; ++k) scale[k] = hi[k] > lo[k] ? 0.999 * kSteps / (hi[k] - lo[k]) : 0;
  for (std::size_t i = 0; i < count; ++i) {
    place(i, at);
    std::uint64_t key = 0;
    std::uint32_t step[kNumbers];
    for (int k = 0; k < kNumbers; ++k) {
      const double x = (at[k] - lo[k]) * scale[k];
      step[k] = x >= 0 && x < kSteps ? static_cast<std::uint32_t>(x) : 0;
    }
    for (int bit = kBits - 1; bit >= 0; --bit) {
      for (int k = 0; k < kNumbers; ++k) key = key << 1 | (step[k] >> bit & 1);
    }
    keys_[i] = key << 32 | i;
  }
  return sort();
}

}  // namespace tandem
