#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "tandem/formats/block.h"
#include "tandem/kernels/detail/box_tree.h"

namespace tandem {

/// A way through the bodies in about the order of a bound.
class BodyVisit {
 public:
  void begin(const BoxTree& tree) {
    height_ = 0;
    // A body that is alone needs no bound.
    if (tree.items.size() == 1)
      stack_[height_++] = {-HUGE_VAL, tree.items[0].box, -1};
    else if (tree.items.size() > 1)
      stack_[height_++] = {-HUGE_VAL, 0, tree.top()};
  }

  /// The next body, or kNoIndex. bound(world box) -> double is not above what it is for anything in the box,
  /// and infinity where nothing there counts. Those with a bound of more than `limit` are passed over.
  template <typename Bound>
  std::uint32_t next(const BoxTree& tree, const Bound& bound, double limit) {
    while (height_ > 0) {
      const Entry entry = stack_[--height_];
      if (!(entry.bound <= limit)) continue;
      if (entry.level < 0) return static_cast<std::uint32_t>(entry.number);
      push_group(tree, entry, bound, limit);
    }
    return kNoIndex;
  }

 private:
  struct Entry {
    double bound;
    std::size_t number;
    int level;  // of the group; -1: a body
  };

  // Pushes what is in a group, the nearest last.
  template <typename Bound>
  void push_group(const BoxTree& tree, const Entry& entry, const Bound& bound, double limit) {
    const BoxTree::Group& group = tree.level(entry.level)[entry.number];
    const std::size_t bottom = height_;
    for (std::size_t i = 0; i < BoxTree::kGroup; ++i) {
      WorldBox box;
      for (int k = 0; k < 3; ++k) box.lo[k] = group.lo[k][i], box.hi[k] = group.hi[k][i];
      if (!(box.lo[0] <= box.hi[0])) continue;
      const double least = bound(box);
      if (!(least <= limit) || least == HUGE_VAL) continue;
      const std::size_t below = BoxTree::kGroup * entry.number + i;
      const Entry next = {least, entry.level == 0 ? tree.items[below].box : below, entry.level - 1};
      std::size_t at = height_++;
      for (; at > bottom && stack_[at - 1].bound < least; --at) stack_[at] = stack_[at - 1];
      stack_[at] = next;
    }
  }

  Entry stack_[3 * BoxTree::kMostLevels + BoxTree::kGroup + 1];
  std::size_t height_ = 0;
};

/// Visits all bodies of the way; visit(body) may make the limit less.
template <typename Bound, typename Visit>
void visit_nearest(const BoxTree& tree, const Bound& bound, const double& limit, const Visit& visit) {
  BodyVisit way;
  way.begin(tree);
  for (std::uint32_t body; (body = way.next(tree, bound, limit)) != kNoIndex;) visit(body);
}

}  // namespace tandem
