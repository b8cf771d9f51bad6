#include "tandem/kernels/broad_phase.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "tandem/kernels/detail/traversal.h"

namespace tandem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t groups_over(std::size_t count) {
  return (count + 3) / 4;
}

}  // namespace

// Brings items into the order of the tree: `units` runs of `unit` items, the last of which may be shorter,
// each again split into four. A unit is a power of four.
void BroadPhase::split(Item* items, std::size_t count, std::size_t unit, std::size_t units) {
  if (count <= 1) return;
  if (units == 1) {
    if (unit > 1) split(items, count, unit / kGroup, (count + unit / kGroup - 1) / (unit / kGroup));
    return;
  }
  double lo[3] = {kInfinity, kInfinity, kInfinity}, hi[3] = {-kInfinity, -kInfinity, -kInfinity};
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double c = items[i].center[k];
      lo[k] = c < lo[k] ? c : lo[k];
      hi[k] = c > hi[k] ? c : hi[k];
    }
  }
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (hi[k] - lo[k] > hi[axis] - lo[axis]) axis = k;
  }
  const std::size_t left_units = (units + 1) / 2, left = left_units * unit;
  std::nth_element(items, items + left, items + count,
                   [axis](const Item& x, const Item& y) { return x.center[axis] < y.center[axis]; });
  split(items, left, unit, left_units);
  split(items + left, count - left, unit, units - left_units);
}

// Boxes in the order of the tree, then the groups over them, level by level: group g of a level holds
// the boxes of 4 g to 4 g + 3 of the level below.
bool BroadPhase::build(std::span<const WorldBox> boxes) {
  const std::size_t count = boxes.size();
  std::size_t total = 0;
  levels_ = 0;
  for (std::size_t below = count; levels_ == 0 || below > 1; below = groups_over(below)) {
    level_begin_[levels_++] = total;
    total += groups_over(below);
  }
  if (!items_.resize(count) || !groups_.resize(total)) return false;
  for (std::uint32_t b = 0; b < count; ++b) {
    for (int k = 0; k < 3; ++k) items_[b].center[k] = 0.5 * boxes[b].lo[k] + 0.5 * boxes[b].hi[k];
    items_[b].box = b;
  }
  std::size_t unit = 1;
  while (unit * kGroup < count) unit *= kGroup;
  split(items_.data(), count, unit, (count + unit - 1) / unit);

  std::size_t below = count;
  for (int level = 0; level < levels_; ++level, below = groups_over(below)) {
    for (std::size_t i = 0; i < groups_over(below) * kGroup; ++i) {
      Group& group = groups_[level_begin_[level] + i / kGroup];
      for (int k = 0; k < 3; ++k) {
        double &lo = group.lo[k][i % kGroup], &hi = group.hi[k][i % kGroup];
        lo = kInfinity;
        hi = -kInfinity;
        if (i >= below) continue;
        if (level == 0) {
          lo = boxes[items_[i].box].lo[k];
          hi = boxes[items_[i].box].hi[k];
          continue;
        }
        const Group& child = groups_[level_begin_[level - 1] + i];
        for (int c = 0; c < kGroup; ++c) {
          lo = child.lo[k][c] < lo ? child.lo[k][c] : lo;
          hi = child.hi[k][c] > hi ? child.hi[k][c] : hi;
        }
      }
    }
  }
  return true;
}

// Bit 4 i + j: box i of a meets box j of b.
std::uint32_t BroadPhase::meeting(const Group& a, const Group& b) {
  std::uint32_t mask = 0;
  for (int i = 0; i < kGroup; ++i) {
    std::uint32_t hit[kGroup] = {1, 1, 1, 1};
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < kGroup; ++j) {
        hit[j] &= static_cast<std::uint32_t>(a.lo[k][i] <= b.hi[k][j]) &
                  static_cast<std::uint32_t>(b.lo[k][j] <= a.hi[k][i]);
      }
    }
    mask |= (hit[0] | hit[1] << 1 | hit[2] << 2 | hit[3] << 3) << 4 * i;
  }
  return mask;
}

// The tree against itself. Both groups of a pair are on one level, and each pair taken off puts at most 16 of
// the level below on, of which at most 15 wait while the last one's are worked on: 15 for each level above
// the leaves, and one.
bool BroadPhase::collect() {
  struct GroupPair {
    std::uint32_t a, b;  // within their level; a <= b
    int level;
  };
  GroupPair stack[15 * std::size(level_begin_) + 1];
  std::size_t height = 0;
  stack[height++] = {0, 0, levels_ - 1};
  found_.clear();
  group_pairs_ = 0;
  while (height > 0) {
    const GroupPair pair = stack[--height];
    const std::size_t begin = level_begin_[pair.level];
    std::uint32_t mask = meeting(groups_[begin + pair.a], groups_[begin + pair.b]);
    if (pair.a == pair.b) mask &= own_node_pairs(pair.level == 0);
    ++group_pairs_;
    for (; mask != 0; mask &= mask - 1) {
      const auto bit = static_cast<std::uint32_t>(lowest_bit(mask));
      const std::uint32_t a = pair.a * kGroup + bit / 4, b = pair.b * kGroup + bit % 4;
      if (pair.level > 0) {
        stack[height++] = {a, b, pair.level - 1};
      } else if (!found_.push(
                     {std::min(items_[a].box, items_[b].box), std::max(items_[a].box, items_[b].box)})) {
        return false;
      }
    }
  }
  return true;
}

// Counting sort by a; the few pairs of each a are then sorted by b.
bool BroadPhase::sort_pairs(std::size_t boxes) {
  if (!first_.resize(boxes) || !pairs_.resize(found_.size())) return false;
  std::fill_n(first_.data(), boxes, 0u);
  for (const ObjectPair& pair : found_.view()) ++first_[pair.a];
  std::uint32_t sum = 0;
  for (std::size_t a = 0; a < boxes; ++a) sum += std::exchange(first_[a], sum);
  for (const ObjectPair& pair : found_.view()) pairs_[first_[pair.a]++] = pair;
  const auto by_b = [](const ObjectPair& x, const ObjectPair& y) { return x.b < y.b; };
  std::uint32_t begin = 0;
  for (std::size_t a = 0; a < boxes; begin = first_[a++])
    std::sort(pairs_.data() + begin, pairs_.data() + first_[a], by_b);
  return true;
}

Status BroadPhase::find_pairs(std::span<const WorldBox> boxes) {
  pairs_.clear();
  group_pairs_ = 0;
  if (boxes.size() >= kNoIndex) return Status::kTooManyInstances;
  for (const WorldBox& box : boxes) {
    if (!in_range(box)) return Status::kOutOfRange;
  }
  if (boxes.size() < 2) return Status::kOk;
  if (!build(boxes) || !collect()) return Status::kOutOfMemory;
  if (found_.size() >= kNoIndex) return Status::kTooManyPairs;
  return sort_pairs(boxes.size()) ? Status::kOk : Status::kOutOfMemory;
}

}  // namespace tandem
