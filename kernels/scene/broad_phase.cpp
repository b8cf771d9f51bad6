#include "tandem/kernels/broad_phase.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <new>
#include <tuple>
#include <type_traits>
#include <utility>

#include "kernels/common/traversal.h"
#include "kernels/common/worker_threads.h"

namespace tandem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t groups_over(std::size_t count) {
  return (count + 3) / 4;
}

// Boxes or groups that a worker takes at a time: some microseconds of work.
constexpr std::size_t kBoxesAtOnce = 256, kGroupsAtOnce = 64;

// Ranges that are split by one worker each: enough for all to be busy until the end, none too small.
constexpr std::size_t kRangesForEach = 4, kMostRanges = 256, kFewestItems = 64;

// Walks of the tree against itself for each worker: so many that the longest is short beside all.
constexpr std::size_t kWalksForEach = 16;

// The value, and one is added to it; other workers may do the same where there are any.
std::uint32_t next_of(std::uint32_t& value, std::uint32_t workers) {
  return workers == 1 ? value++ : std::atomic_ref(value).fetch_add(1, std::memory_order_relaxed);
}

bool tells_apart(const PairFilter& filter) {
  return filter.motion != nullptr || filter.group != nullptr || filter.mask != nullptr ||
         filter.world != nullptr;
}

// The motions that meet one; a bit for each.
std::uint32_t motions_that_meet(Motion one) {
  std::uint32_t met = 0;
  for (std::uint32_t m = 0; m < 4; ++m)
    met |= static_cast<std::uint32_t>(motions_meet(one, static_cast<Motion>(m))) << m;
  return met;
}

}  // namespace

bool BoxTree::reserve(std::size_t boxes, const PairFilter& filter) {
  std::size_t total = 0;
  levels = 0;
  for (std::size_t below = boxes; levels == 0 || below > 1; below = groups_over(below)) {
    level_begin[levels++] = total;
    total += groups_over(below);
  }
  return items.resize(boxes) && groups.resize(total) && kinds.resize(tells_apart(filter) ? total : 0);
}

BoxTree::Kind BoxTree::Kind::of(const PairFilter& filter, std::size_t box) {
  const Motion motion = filter.motion != nullptr ? filter.motion[box] : Motion::moving;
  return {filter.group != nullptr ? filter.group[box] : ~0u, filter.mask != nullptr ? filter.mask[box] : ~0u,
          1u << (static_cast<std::uint32_t>(motion) & 3), motions_that_meet(motion),
          WorldRange::of(filter.world != nullptr ? filter.world[box] : 0)};
}

// Orders kinds of boxes that are in one world.
bool BoxTree::Kind::before(const Kind& other) const {
  const auto order = [](const Kind& k) { return std::tie(k.group, k.mask, k.motions, k.met); };
  return order(*this) < order(other);
}

void BoxTree::Kind::add(const Kind& more) {
  group |= more.group;
  mask |= more.mask;
  motions |= more.motions;
  met |= more.met;
  worlds.add(more.worlds);
}

bool BoxTree::Kind::may_look_at(const Kind& other) const {
  return (met & other.motions) != 0 && groups_meet(group, mask, other.group, other.mask) &&
         worlds.meets(other.worlds);
}

// One for each worker, with nothing found.
bool BroadPhase::provide_finders(std::uint32_t workers) {
  if (finder_count_ < workers) {
    finders_.reset(new (std::nothrow) Finder[workers]);
    finder_count_ = finders_ != nullptr ? workers : 0;
    if (finders_ == nullptr) return false;
  }
  for (std::uint32_t i = 0; i < workers; ++i) {
    finders_[i].pairs.clear();
    finders_[i].group_pairs = 0;
    finders_[i].enough_memory = true;
  }
  return true;
}

// The tree's items, in the order of `numbers`, or of boxes where it is null. False: a box is out of range.
bool BroadPhase::take(std::span<const WorldBox> boxes, const std::uint32_t* world,
                      const std::uint32_t* numbers, Tree& tree, Team team) {
  std::atomic<bool> all_in_range = true;
  Item* const items = tree.items.data();
  team.threads.for_parts(team.workers, tree.items.size(), kBoxesAtOnce,
                         [&](std::size_t begin, std::size_t end, std::uint32_t) {
                           bool in = true;
                           for (std::size_t i = begin; i < end; ++i) {
                             const std::size_t b = numbers == nullptr ? i : numbers[i];
                             in = in && in_range(boxes[b]);
                             for (int k = 0; k < 3; ++k)
                               items[i].centre[k] = 0.5 * boxes[b].lo[k] + 0.5 * boxes[b].hi[k];
                             items[i].box = static_cast<std::uint32_t>(b);
                             items[i].world = world != nullptr ? world[b] : 0;
                           }
                           if (!in) all_in_range.store(false, std::memory_order_relaxed);
                         });
  return all_in_range;
}

// Splits a range at the median: by world where it has several, else along its longest extent. `range` keeps
// the left half. Where all centres are one, instances that the filter treats alike stay together. False:
// there is nothing to split.
bool BroadPhase::halve(Item* all, const PairFilter& filter, Range& range, Range& right) {
  if (range.count <= 1) return false;
  while (range.units == 1) {
    if (range.unit == 1) return false;
    range.unit /= kGroup;
    range.units = (range.count + range.unit - 1) / range.unit;
  }
  Item* const items = all + range.begin;
  const std::size_t count = range.count;
  double lo[3] = {kInfinity, kInfinity, kInfinity}, hi[3] = {-kInfinity, -kInfinity, -kInfinity};
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double c = items[i].centre[k];
      lo[k] = c < lo[k] ? c : lo[k];
      hi[k] = c > hi[k] ? c : hi[k];
    }
  }
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (hi[k] - lo[k] > hi[axis] - lo[axis]) axis = k;
  }
  const std::size_t left_units = (range.units + 1) / 2, left = left_units * range.unit;
  const auto of_first = [&](const Item& item) { return item.world == items[0].world; };
  if (filter.world != nullptr && !std::all_of(items, items + count, of_first)) {
    std::nth_element(items, items + left, items + count,
                     [](const Item& x, const Item& y) { return x.world < y.world; });
  } else if (tells_apart(filter) && !(hi[axis] > lo[axis])) {
    std::nth_element(items, items + left, items + count, [&](const Item& x, const Item& y) {
      return Kind::of(filter, x.box).before(Kind::of(filter, y.box));
    });
  } else {
    std::nth_element(items, items + left, items + count,
                     [axis](const Item& x, const Item& y) { return x.centre[axis] < y.centre[axis]; });
  }
  right = {range.begin + left, count - left, range.unit, range.units - left_units};
  range = {range.begin, left, range.unit, left_units};
  return true;
}

// Brings items into the order of the tree.
void BroadPhase::split(Item* all, const PairFilter& filter, Range range) {
  for (Range right; halve(all, filter, range, right);) split(all, filter, right);
}

// Lets the workers split a range: the ranges do not depend on who splits them, nor when. Each round halves
// all that there are, until there are enough.
void BroadPhase::split(Item* all, const PairFilter& filter, Range range, Team team) {
  Range ranges[kMostRanges] = {range};
  const std::size_t enough = team.workers == 1 ? 1 : std::min(kMostRanges, kRangesForEach * team.workers);
  std::size_t count = 1;
  for (; count < enough && range.count / count >= 2 * kFewestItems; count *= 2) {
    team.threads.for_parts(team.workers, count, 1, [&](std::size_t begin, std::size_t end, std::uint32_t) {
      for (std::size_t i = begin; i < end; ++i) {
        if (!halve(all, filter, ranges[i], ranges[count + i])) ranges[count + i] = {};
      }
    });
  }
  team.threads.for_parts(team.workers, count, 1, [&](std::size_t begin, std::size_t end, std::uint32_t) {
    for (std::size_t i = begin; i < end; ++i) split(all, filter, ranges[i]);
  });
}

// Boxes in the order of the tree, then the groups over them, level by level: group g of a level holds
// the boxes of 4 g to 4 g + 3 of the level below.
void BroadPhase::build(std::span<const WorldBox> boxes, const PairFilter& filter, Tree& tree, Team team) {
  const std::size_t count = tree.items.size();
  std::size_t unit = 1;
  while (unit * kGroup < count) unit *= kGroup;
  split(tree.items.data(), filter, {0, count, unit, (count + unit - 1) / unit}, team);
  std::size_t below = count;
  for (int level = 0; level < tree.levels; ++level, below = groups_over(below)) {
    build_level(level, below, boxes, tree, team);
    if (tree.kinds.size() > 0) build_kinds(level, below, filter, tree, team);
  }
}

void BroadPhase::build_level(int level, std::size_t below, std::span<const WorldBox> boxes, Tree& tree,
                             Team team) {
  const auto fill = [&](std::size_t first, std::size_t last, std::uint32_t) {
    for (std::size_t i = first * kGroup; i < last * kGroup; ++i) {
      Group& group = tree.groups[tree.level_begin[level] + i / kGroup];
      for (int k = 0; k < 3; ++k) {
        double &lo = group.lo[k][i % kGroup], &hi = group.hi[k][i % kGroup];
        lo = kInfinity;
        hi = -kInfinity;
        if (i >= below) continue;
        if (level == 0) {
          lo = boxes[tree.items[i].box].lo[k];
          hi = boxes[tree.items[i].box].hi[k];
          continue;
        }
        const Group& child = tree.level(level - 1)[i];
        for (int c = 0; c < kGroup; ++c) {
          lo = child.lo[k][c] < lo ? child.lo[k][c] : lo;
          hi = child.hi[k][c] > hi ? child.hi[k][c] : hi;
        }
      }
    }
  };
  team.threads.for_parts(team.workers, groups_over(below), kGroupsAtOnce, fill);
}

void BroadPhase::build_kinds(int level, std::size_t below, const PairFilter& filter, Tree& tree, Team team) {
  const auto fill = [&](std::size_t first, std::size_t last, std::uint32_t) {
    for (std::size_t i = first * kGroup; i < last * kGroup; ++i) {
      Kind kind;
      if (i < below && level == 0) kind = Kind::of(filter, tree.items[i].box);
      if (i < below && level > 0) {
        for (const Kind& child : tree.kinds[tree.level_begin[level - 1] + i].of) kind.add(child);
      }
      tree.kinds[tree.level_begin[level] + i / kGroup].of[i % kGroup] = kind;
    }
  };
  team.threads.for_parts(team.workers, groups_over(below), kGroupsAtOnce, fill);
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

// Finds what meets of a pair of groups; each pair of boxes of a group with itself once. On levels that one
// tree has not got, its root is child 0 of itself, which meets whatever one of its boxes meets.
std::uint32_t BroadPhase::meeting(const TreePair& trees, const GroupPair& pair) {
  if (trees.same()) {
    const Group* const groups = trees.a.level(pair.level);
    const std::uint32_t own = meeting(groups[pair.a], groups[pair.b]);
    return pair.a == pair.b ? own & own_node_pairs(pair.level == 0) : own;
  }
  const int top_a = trees.a.top(), top_b = trees.b.top();
  const std::uint32_t mask = meeting(trees.a.level(std::min(pair.level, top_a))[pair.a],
                                     trees.b.level(std::min(pair.level, top_b))[pair.b]);
  if (pair.level > top_a) return (mask | mask >> 4 | mask >> 8 | mask >> 12) & 0x000F;
  if (pair.level > top_b) return (mask | mask >> 1 | mask >> 2 | mask >> 3) & 0x1111;
  return mask;
}

// Finds what meets of a pair of groups, where the filter may look at a pair below: if it looks at x and y, it
// does at anything that has all of their groups, masks, motions and worlds, and more. Of kept boxes no more
// is known than that they are fixed and in which world, as the filter may differ from call to call. Pairs of
// boxes are asked about by themselves.
std::uint32_t BroadPhase::may_look(const TreePair& trees, const GroupPair& pair) {
  std::uint32_t mask = meeting(trees, pair);
  constexpr Kind kFixed = {~0u, ~0u, 1u << static_cast<std::uint32_t>(Motion::fixed), 0, {0, kEveryWorld}};
  if (pair.level == 0 || trees.a.kinds.size() == 0 || pair.level > trees.a.top()) return mask;
  const bool b_is_known = trees.b.kinds.size() != 0 && pair.level <= trees.b.top();
  for (std::uint32_t left = mask; left != 0; left &= left - 1) {
    const int bit = lowest_bit(left);
    const Kind& a = trees.a.kinds_of(pair.level)[pair.a].of[bit / 4];
    const Kind& b = b_is_known ? trees.b.kinds_of(pair.level)[pair.b].of[bit % 4] : kFixed;
    if (!a.may_look_at(b)) mask &= ~(1u << bit);
  }
  return mask;
}

// A tree against itself or another, from one pair of groups on. Each pair taken off puts at most 16 of the
// level below on, of which at most 15 wait while the last one's are worked on: 15 for each level above the
// leaves, and one. owners: the workers that may be doing the same.
void BroadPhase::collect(const TreePair& trees, GroupPair from, const PairFilter& filter,
                         std::uint32_t owners, Finder& finder) {
  GroupPair stack[15 * std::extent_v<decltype(Tree::level_begin)> + 1];
  std::size_t height = 0;
  stack[height++] = from;
  std::uint64_t looked_at = 0;
  while (height > 0) {
    const GroupPair pair = stack[--height];
    ++looked_at;
    for (std::uint32_t mask = may_look(trees, pair); mask != 0; mask &= mask - 1) {
      const auto bit = static_cast<std::uint32_t>(lowest_bit(mask));
      const std::uint32_t a = pair.a * kGroup + bit / 4, b = pair.b * kGroup + bit % 4;
      if (pair.level > 0) {
        stack[height++] = {a, b, pair.level - 1};
        continue;
      }
      const std::uint32_t x = trees.a.items[a].box, y = trees.b.items[b].box;
      if (!filter.looks_at(x, y)) continue;
      if (finder.pairs.push({std::min(x, y), std::max(x, y)}, owners)) continue;
      finder.enough_memory = false;
      return;
    }
  }
  finder.group_pairs += looked_at;
}

// One walk until there are enough pairs of groups, or one of leaves, for each worker to walk on from many.
bool BroadPhase::collect(const TreePair& trees, const PairFilter& filter, Team team) {
  starts_.clear();
  if (!starts_.push({0, 0, std::max(trees.a.top(), trees.b.top())})) return false;
  const std::size_t enough = team.workers == 1 ? 1 : kWalksForEach * team.workers;
  std::size_t taken = 0;
  for (; taken < starts_.size() && starts_.size() - taken < enough && starts_[taken].level > 0; ++taken) {
    const GroupPair pair = starts_[taken];
    for (std::uint32_t mask = may_look(trees, pair); mask != 0; mask &= mask - 1) {
      const auto bit = static_cast<std::uint32_t>(lowest_bit(mask));
      if (!starts_.push({pair.a * kGroup + bit / 4, pair.b * kGroup + bit % 4, pair.level - 1})) return false;
    }
  }
  const auto walk = [&](std::size_t begin, std::size_t end, std::uint32_t worker) {
    Finder& finder = finders_[worker];
    for (std::size_t i = begin; i < end && finder.enough_memory; ++i)
      collect(trees, starts_[taken + i], filter, team.workers, finder);
  };
  team.threads.for_parts(team.workers, starts_.size() - taken, 1, walk);
  group_pairs_ += taken;
  bool enough_memory = true;
  for (std::uint32_t i = 0; i < team.workers; ++i) {
    group_pairs_ += std::exchange(finders_[i].group_pairs, 0);
    enough_memory = enough_memory && finders_[i].enough_memory;
  }
  return enough_memory;
}

// Boxes with themselves.
bool BroadPhase::collect_selves(const PairFilter& filter) {
  for (std::size_t i = 0; i < tree_.items.size(); ++i) {
    const std::uint32_t a = free_box(i);
    if (filter.looks_at(a, a) && !finders_[0].pairs.push({a, a})) return false;
  }
  return true;
}

// Counting sort by a, or by runs of a where the boxes are many more than pairs and boxes that were looked at;
// the few pairs of each run are then sorted, which makes their order unique.
Status BroadPhase::sort_pairs(std::size_t boxes, Team team) {
  std::size_t total = 0;
  for (std::uint32_t i = 0; i < team.workers; ++i) total += finders_[i].pairs.size();
  if (total >= kNoIndex) return Status::kTooManyPairs;
  int shift = 0;
  while ((boxes >> shift) > std::max(tree_.items.size(), total)) ++shift;
  const std::size_t runs = ((boxes - 1) >> shift) + 1;
  if (!pairs_.resize(total) || !first_.resize(runs)) return Status::kOutOfMemory;
  const auto each_found = [&](const auto& take) {
    team.threads.for_parts(team.workers, team.workers, 1,
                           [&](std::size_t begin, std::size_t end, std::uint32_t) {
                             for (std::size_t i = begin; i < end; ++i) {
                               for (const ObjectPair& pair : finders_[i].pairs.view()) take(pair);
                             }
                           });
  };
  std::uint32_t* const first = first_.data();
  ObjectPair* const pairs = pairs_.data();
  const std::uint32_t workers = team.workers;
  std::fill_n(first, runs, 0u);
  each_found([=](const ObjectPair& pair) { next_of(first[pair.a >> shift], workers); });
  std::uint32_t sum = 0;
  for (std::size_t run = 0; run < runs; ++run) sum += std::exchange(first[run], sum);
  each_found([=](const ObjectPair& pair) { pairs[next_of(first[pair.a >> shift], workers)] = pair; });
  const auto sort_run = [=](std::uint32_t begin, std::uint32_t end) {
    if (shift == 0) {
      std::sort(pairs + begin, pairs + end, [](auto& x, auto& y) { return x.b < y.b; });
    } else {
      std::sort(pairs + begin, pairs + end,
                [](auto& x, auto& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
    }
  };
  team.threads.for_parts(team.workers, runs, kBoxesAtOnce,
                         [=](std::size_t begin, std::size_t end, std::uint32_t) {
                           std::uint32_t from = begin > 0 ? first[begin - 1] : 0;
                           for (std::size_t run = begin; run < end; from = first[run++])
                             sort_run(from, first[run]);
                         });
  // Which worker finds which pairs is chance: so that no call of the same scene allocates, there is room for
  // all in each.
  for (std::uint32_t i = 0; i < team.workers && team.workers > 1; ++i) {
    if (!finders_[i].pairs.resize(total)) break;  // then it will grow when it has to
  }
  return Status::kOk;
}

Status BroadPhase::find_pairs(std::span<const WorldBox> boxes, const PairFilter& filter) {
  WorkerThreads none;
  return find_pairs(boxes, filter, false, none, 1);
}

Status BroadPhase::find_pairs(std::span<const WorldBox> boxes, const PairFilter& filter, bool self_pairs,
                              WorkerThreads& threads, std::uint32_t workers) {
  const Team team = {threads, workers};
  pairs_.clear();
  group_pairs_ = 0;
  if (boxes.size() >= kNoIndex) return Status::kTooManyInstances;
  if (kept_of_ != 0 && kept_of_ != boxes.size()) return Status::kKeptMismatch;
  if (filter.excluded.instances > boxes.size()) return Status::kUnknownInstance;
  const std::size_t count = free_count(boxes.size());
  if (!tree_.reserve(count, filter) || !provide_finders(workers)) return Status::kOutOfMemory;
  if (!take(boxes, filter.world, kept_of_ != 0 ? free_.data() : nullptr, tree_, team))
    return Status::kOutOfRange;
  if (count == 0) return Status::kOk;
  build(boxes, filter, tree_, team);
  if (!collect({tree_, tree_}, filter, team)) return Status::kOutOfMemory;
  if (kept_of_ != 0 && !collect({tree_, kept_}, filter, team)) return Status::kOutOfMemory;
  if (self_pairs && !collect_selves(filter)) return Status::kOutOfMemory;
  return sort_pairs(boxes.size(), team);
}

Status BroadPhase::keep_fixed(std::span<const WorldBox> boxes, std::span<const Motion> motion,
                              const std::uint32_t* world) {
  WorkerThreads none;
  return keep_fixed(boxes, motion, world, none, 1);
}

// Keeps the fixed boxes; none are kept where none is fixed.
Status BroadPhase::keep_fixed(std::span<const WorldBox> boxes, std::span<const Motion> motion,
                              const std::uint32_t* world, WorkerThreads& threads, std::uint32_t workers) {
  const Team team = {threads, workers};
  forget_fixed();
  pairs_.clear();
  group_pairs_ = 0;
  if (boxes.size() >= kNoIndex) return Status::kTooManyInstances;
  if (boxes.size() != motion.size()) return Status::kKeptMismatch;
  const auto fixed = static_cast<std::size_t>(std::count(motion.begin(), motion.end(), Motion::fixed));
  // Where there is one world, the kept boxes have nothing that tells them apart.
  const PairFilter kinds = {.motion = world != nullptr ? motion.data() : nullptr, .world = world};
  if (!free_.resize(boxes.size() - fixed) || !fixed_.resize(fixed) || !kept_.reserve(fixed, kinds))
    return Status::kOutOfMemory;
  std::size_t free_now = 0, fixed_now = 0;
  for (std::uint32_t b = 0; b < boxes.size(); ++b) {
    if (motion[b] == Motion::fixed) {
      fixed_[fixed_now++] = b;
    } else {
      free_[free_now++] = b;
    }
  }
  if (!take(boxes, world, fixed_.data(), kept_, team)) return Status::kOutOfRange;
  if (fixed == 0) return Status::kOk;
  build(boxes, kinds, kept_, team);
  kept_of_ = boxes.size();
  return Status::kOk;
}

Status BroadPhase::make_tree(std::span<const WorldBox> boxes, const PairFilter& filter,
                             WorkerThreads& threads, std::uint32_t workers, BoxTree& tree) {
  const Team team = {threads, workers};
  if (boxes.size() >= kNoIndex) return Status::kTooManyInstances;
  if (!tree.reserve(boxes.size(), filter)) return Status::kOutOfMemory;
  if (!take(boxes, filter.world, nullptr, tree, team)) return Status::kOutOfRange;
  if (!boxes.empty()) build(boxes, filter, tree, team);
  return Status::kOk;
}

void BroadPhase::forget_fixed() {
  kept_of_ = 0;
}

}  // namespace tandem
