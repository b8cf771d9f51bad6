#pragma once
#include <cmath>
#include <cstdint>

#include "tandem/formats/block.h"
#include "tandem/formats/platform.h"
#include "tandem/kernels/detail/box_tree.h"

namespace tandem {

/// A way through the bodies of a tree of world boxes in about the order of a bound, for CPU and GPU. Tree: as
/// BoxTree; level(i) has the groups of a level, of which level top() is one group, and body(i) names one of
/// the count() bodies by its place in level 0.
class BodyVisit {
 public:
  template <typename Tree>
  TANDEM_HD void begin(const Tree& tree) {
    height_ = 0;
    // A body that is alone needs no bound.
    if (tree.count() == 1)
      stack_[height_++] = {-HUGE_VAL, 0, -1};
    else if (tree.count() > 1)
      stack_[height_++] = {-HUGE_VAL, 0, tree.top()};
  }

  /// The next body, or kNoIndex. bound(world box) -> double is not above what it is for anything in the box,
  /// and infinity where nothing there counts. Those with a bound of more than `limit` are passed over.
  template <typename Tree, typename Bound>
  TANDEM_HD std::uint32_t next(const Tree& tree, const Bound& bound, double limit) {
    while (height_ > 0) {
      const Entry entry = stack_[--height_];
      if (!(entry.bound <= limit)) continue;
      if (entry.level < 0) return tree.body(entry.number);
      push_group(tree.level(entry.level)[entry.number], entry, bound, limit);
    }
    return kNoIndex;
  }

 private:
  struct Entry {
    double bound;
    std::uint32_t number;
    std::int32_t level;  // of the group; -1: a place of a body
  };

  // Pushes what is in a group, the nearest last.
  template <typename Bound>
  TANDEM_HD void push_group(const BoxTree::Group& group, const Entry& entry, const Bound& bound,
                            double limit) {
    const int bottom = height_;
    for (int i = 0; i < BoxTree::kGroup; ++i) {
      WorldBox box;
      for (int k = 0; k < 3; ++k) box.lo[k] = group.lo[k][i], box.hi[k] = group.hi[k][i];
      if (!(box.lo[0] <= box.hi[0])) continue;
      const double least = bound(box);
      if (!(least <= limit) || least == HUGE_VAL) continue;
      const Entry next = {least, BoxTree::kGroup * entry.number + static_cast<std::uint32_t>(i),
                          entry.level - 1};
      int at = height_++;
      for (; at > bottom && stack_[at - 1].bound < least; --at) stack_[at] = stack_[at - 1];
      stack_[at] = next;
    }
  }

  Entry stack_[(BoxTree::kGroup - 1) * BoxTree::kMostLevels + BoxTree::kGroup + 1];
  int height_ = 0;
};

/// Visits all bodies of the way; visit(body) may make the limit less.
template <typename Tree, typename Bound, typename Visit>
TANDEM_HD inline void visit_bodies(const Tree& tree, const Bound& bound, const double& limit,
                                   const Visit& visit) {
  BodyVisit way;
  way.begin(tree);
  for (std::uint32_t body; (body = way.next(tree, bound, limit)) != kNoIndex;) visit(body);
}

}  // namespace tandem
