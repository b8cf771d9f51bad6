#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/pair_filter.h"
#include "tandem/kernels/world_box.h"

namespace tandem {

/// A tree of world boxes: items and groups of four over them; level 0 holds the items' boxes.
struct BoxTree {
  static constexpr int kGroup = 4;

  /// A box on its way to its place in the tree.
  struct Item {
    double centre[3];
    std::uint32_t box, world;
  };

  /// Four boxes, or the boxes of four groups; where there are fewer, the others are empty, [inf, -inf].
  struct alignas(64) Group {
    double lo[3][kGroup], hi[3][kGroup];
  };

  /// What a filter says of a box, or of all boxes of a group together: their groups and masks, a bit for
  /// each of their motions and for each that meets one of these, and their worlds.
  struct Kind {
    std::uint32_t group = 0, mask = 0, motions = 0, met = 0;
    WorldRange worlds;

    static Kind of(const PairFilter& filter, std::size_t box);
    bool before(const Kind& other) const;
    void add(const Kind& more);
    bool may_look_at(const Kind& other) const;
  };
  struct Kinds {
    Kind of[kGroup];
  };

  Buffer<Item> items;                // in the order of the tree
  Buffer<Group> groups;              // level by level
  Buffer<Kinds> kinds;               // of the groups, where the filter tells instances apart; else none
  std::size_t level_begin[17] = {};  // where each level of groups begins
  int levels = 0;

  bool reserve(std::size_t boxes, const PairFilter& filter);
  void clear() {
    items.clear(), groups.clear(), kinds.clear();
    levels = 0;
  }
  int top() const { return levels - 1; }
  const Group* level(int i) const { return groups.data() + level_begin[i]; }
  const Kinds* kinds_of(int i) const { return kinds.data() + level_begin[i]; }

  /// Calls visit(place) for each item whose box meets this one; `items` says which box is in a place. kind:
  /// where it is given, items may be left out at which the filter does not look from there.
  template <typename Visit>
  void visit(const WorldBox& box, const Kind* kind, const Visit& visit) const;
  template <typename Visit>
  void visit(const WorldBox& box, const Visit& each) const {
    visit(box, nullptr, each);
  }

  /// Visits places in about the order of a bound: bound(world box) -> double is not above what it is for
  /// anything in the box, and infinity where nothing there counts. Those with a bound of more than `limit`
  /// are passed over; visit(place) may make that less.
  template <typename Bound, typename Visit>
  void visit_nearest(const Bound& bound, const double& limit, const Visit& visit) const;
};

template <typename Visit>
void BoxTree::visit(const WorldBox& box, const Kind* kind, const Visit& visit) const {
  if (items.size() == 0) return;
  // Each group taken off puts at most four of the level below on, of which three wait at most.
  struct Waiting {
    std::size_t group;
    int level;
  } stack[(kGroup - 1) * std::size(BoxTree{}.level_begin) + 1];
  int height = 0;
  stack[height++] = {0, top()};
  while (height > 0) {
    const Waiting at = stack[--height];
    const Group& group = level(at.level)[at.group];
    for (std::size_t i = 0; i < kGroup; ++i) {
      bool meets = true;
      for (int k = 0; k < 3; ++k) meets = meets && group.lo[k][i] <= box.hi[k] && box.lo[k] <= group.hi[k][i];
      if (!meets) continue;
      if (kind != nullptr && kinds.size() != 0 && !kind->may_look_at(kinds_of(at.level)[at.group].of[i]))
        continue;
      if (at.level == 0) {
        visit(kGroup * at.group + i);
      } else {
        stack[height++] = {kGroup * at.group + i, at.level - 1};
      }
    }
  }
}

template <typename Bound, typename Visit>
void BoxTree::visit_nearest(const Bound& bound, const double& limit, const Visit& visit) const {
  if (items.size() == 0) return;
  struct Entry {
    double bound;
    std::size_t number;  // of the group, or a place
    int level;           // of the group; -1: a place
  } stack[(kGroup - 1) * std::size(BoxTree{}.level_begin) + kGroup + 1];
  std::size_t height = 0;
  stack[height++] = {-HUGE_VAL, 0, top()};
  while (height > 0) {
    const Entry entry = stack[--height];
    if (!(entry.bound <= limit)) continue;
    if (entry.level < 0) {
      visit(entry.number);
      continue;
    }
    const Group& group = level(entry.level)[entry.number];
    const std::size_t bottom = height;
    for (std::size_t i = 0; i < kGroup; ++i) {
      WorldBox box;
      for (int k = 0; k < 3; ++k) box.lo[k] = group.lo[k][i], box.hi[k] = group.hi[k][i];
      if (!(box.lo[0] <= box.hi[0])) continue;
      const double least = bound(box);
      if (!(least <= limit) || least == HUGE_VAL) continue;
      const Entry next = {least, kGroup * entry.number + i, entry.level - 1};
      std::size_t at = height++;
      for (; at > bottom && stack[at - 1].bound < least; --at) stack[at] = stack[at - 1];
      stack[at] = next;
    }
  }
}

}  // namespace tandem
