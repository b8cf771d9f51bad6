#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/pair_filter.h"
#include "tandem/kernels/world_box.h"

namespace tandem {

/// A tree of world boxes: items and groups of four over them; level 0 holds the items' boxes.
struct BoxTree {
  static constexpr int kGroup = 4, kMostLevels = 17;

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

  Buffer<Item> items;    // in the order of the tree
  Buffer<Group> groups;  // level by level
  Buffer<Kinds> kinds;   // of the groups, where the filter tells instances apart; else none
  std::size_t level_begin[kMostLevels] = {};  // where each level of groups begins
  int levels = 0;

  bool reserve(std::size_t boxes, const PairFilter& filter);
  void clear() {
    items.clear();
    groups.clear();
    kinds.clear();
    levels = 0;
  }
  std::size_t count() const { return items.size(); }
  std::uint32_t body(std::size_t place) const { return items[place].box; }
  int top() const { return levels - 1; }
  const Group* level(int i) const { return groups.data() + level_begin[i]; }
  const Kinds* kinds_of(int i) const { return kinds.data() + level_begin[i]; }

  /// Calls visit(number) for each box of the tree that meets this one. kind: where it is given, boxes may be
  /// left out at which the filter does not look from there.
  template <typename Visit>
  void visit(const WorldBox& box, const Kind* kind, const Visit& visit) const;
  template <typename Visit>
  void visit(const WorldBox& box, const Visit& each) const {
    visit(box, nullptr, each);
  }
};

template <typename Visit>
void BoxTree::visit(const WorldBox& box, const Kind* kind, const Visit& visit) const {
  if (items.size() == 0) return;
  // Each group taken off puts at most four of the level below on, of which three wait at most.
  struct Waiting {
    std::size_t group;
    int level;
  } stack[(kGroup - 1) * kMostLevels + 1];
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
        visit(items[kGroup * at.group + i].box);
      } else {
        stack[height++] = {kGroup * at.group + i, at.level - 1};
      }
    }
  }
}

}  // namespace tandem
