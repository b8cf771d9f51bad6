#pragma once
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

#include "kernels/common/block_pair.h"
#include "kernels/geometry/local_frame.h"
#include "kernels/points_and_rays/body_tree.h"
#include "kernels/scene/body_visit.h"
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

  const BoxTree& tree() const { return boxes_; }

  /// As visit_bodies() does.
  template <typename Bound, typename Visit>
  void visit(const Bound& bound, const double& limit, const Visit& visit) const {
    visit_bodies(boxes_, bound, limit, visit);
  }

 private:
  std::uint64_t assets_id_ = 0, shapes_id_ = 0, version_ = 0;  // of what this is made
  Buffer<LocalFrame> frames_;
  WorldBox bounds_;
  BoxTree boxes_;
};

/// Has the machine load what is read soon.
inline void fetch_ahead([[maybe_unused]] const void* data) {
#if defined(__GNUC__)
  __builtin_prefetch(data);
#endif
}

/// An order in which things follow each other that lie near each other.
class ProbeOrder {
 public:
  /// Orders the things first to last - 1 by Morton's order of their places. place(i, out) writes three
  /// numbers of thing i; false: the thing is left out. False: out of memory.
  template <typename Place>
  [[nodiscard]] bool make(std::uint32_t first, std::uint32_t last, Place&& place);

  /// The number of things that were not left out.
  std::size_t size() const { return keys_.size(); }

  std::uint32_t operator[](std::size_t i) const { return static_cast<std::uint32_t>(keys_[i]); }

  /// The thing whose data are to be fetched when thing i is looked at.
  std::uint32_t ahead(std::size_t i) const { return (*this)[i + kAhead < keys_.size() ? i + kAhead : i]; }

 private:
  using Place = std::array<float, 3>;
  struct Numbered {
    Place place;
    std::uint32_t number;
  };

  bool sort();

  Buffer<Numbered> places_;
  Buffer<std::uint64_t> keys_, other_;  // a key of kKeyBits in the upper half, a number in the lower
  static constexpr int kKeyBits = 30;
  static constexpr std::size_t kAhead = 8;
};

template <typename PlaceOf>
bool ProbeOrder::make(std::uint32_t first, std::uint32_t last, PlaceOf&& place) {
  if (!places_.resize(last - first)) return false;
  std::size_t count = 0;
  for (std::uint32_t i = first; i < last; ++i) {
    double at[3];
    if (!place(i, at)) continue;
    Numbered& next = places_[count++];
    for (int k = 0; k < 3; ++k) next.place[k] = static_cast<float>(at[k]);
    next.number = i;
  }
  return places_.resize(count) && sort();
}

}  // namespace tandem
