#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/object_pair.h"
#include "tandem/kernels/world_box.h"

namespace tandem {

/// Pairs of boxes that are near each other, for several searches: they are found of boxes that are larger by
/// a margin. While each box lies within its larger one, all pairs that meet are among them. So of bodies that
/// hardly move only these pairs are looked at. What a search finds does not depend on it.
class NearPairs {
 public:
  void forget() { boxes_.clear(); }

  /// Returns whether all pairs of these boxes that meet are among the near ones.
  bool hold(std::span<const WorldBox> boxes) {
    bool within = boxes_.size() == boxes.size() && !boxes.empty();
    for (std::size_t i = 0; i < boxes.size() && within; ++i) {
      for (int k = 0; k < 3; ++k)
        within = within && boxes[i].lo[k] >= boxes_[i].lo[k] && boxes[i].hi[k] <= boxes_[i].hi[k];
    }
    if (within) ++served_;
    return within;
  }

  /// Returns whether near pairs are to be found now, which costs a little more than those that meet: the last
  /// ones served, or none have been found for some time.
  bool are_due() {
    const bool due = served_ >= kFewest || ++waited_ >= kPatience;
    if (due) waited_ = 0;
    served_ = 0;
    return due;
  }

  /// Makes the larger boxes; is_fixed(i): a box that stays as it is. False: they would be no numbers, or
  /// there is no memory.
  template <typename IsFixed>
  bool widen(std::span<const WorldBox> boxes, const IsFixed& is_fixed) {
    double extents = 0;
    for (const WorldBox& box : boxes) extents += std::max({size(box, 0), size(box, 1), size(box, 2), 0.0});
    const double margin = kMargin * extents / static_cast<double>(boxes.size());
    if (!std::isfinite(margin) || !boxes_.resize(boxes.size())) return false;
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
      boxes_[i] = is_fixed(i) ? boxes[i] : grown(boxes[i], margin);
    return true;
  }

  bool take(std::span<const ObjectPair> pairs) {
    if (!pairs_.resize(pairs.size())) return false;
    std::copy(pairs.begin(), pairs.end(), pairs_.data());
    return true;
  }

  std::span<const WorldBox> boxes() const { return boxes_.view(); }
  std::span<const ObjectPair> pairs() const { return pairs_.view(); }

 private:
  static constexpr double kMargin = 0.03;  ///< of the mean box
  static constexpr int kFewest = 2, kPatience = 16;

  static double size(const WorldBox& box, int k) { return box.hi[k] - box.lo[k]; }

  Buffer<WorldBox> boxes_;
  Buffer<ObjectPair> pairs_;
  int served_ = 0, waited_ = 0;
};

}  // namespace tandem
