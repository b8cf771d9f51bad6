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
  int top() const { return levels - 1; }
  const Group* level(int i) const { return groups.data() + level_begin[i]; }
  const Kinds* kinds_of(int i) const { return kinds.data() + level_begin[i]; }
};

}  // namespace tandem
