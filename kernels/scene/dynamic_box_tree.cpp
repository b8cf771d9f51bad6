#include "kernels/scene/dynamic_box_tree.h"

#include <algorithm>

namespace tandem {
namespace {

// A tree is worn out when so many boxes were added, or when one box of so many has left its group: each of
// these costs a visit something, and making the tree anew is then cheap beside the visits that it served.
constexpr std::size_t kMostAdded = 256, kBoxesForOneDisplaced = 16;

// The box of all four of a group.
WorldBox box_of(const BoxTree::Group& group) {
  WorldBox box;
  for (int k = 0; k < 3; ++k) {
    box.lo[k] = *std::min_element(group.lo[k], group.lo[k] + BoxTree::kGroup);
    box.hi[k] = *std::max_element(group.hi[k], group.hi[k] + BoxTree::kGroup);
  }
  return box;
}

// Puts a box into a group. Returns whether it reaches out of the one that was there.
bool put(const WorldBox& box, std::size_t i, BoxTree::Group& group) {
  bool out = false;
  for (int k = 0; k < 3; ++k) {
    out = out || box.lo[k] < group.lo[k][i] || box.hi[k] > group.hi[k][i];
    group.lo[k][i] = box.lo[k];
    group.hi[k][i] = box.hi[k];
  }
  return out;
}

}  // namespace

Status DynamicBoxTree::make(std::span<const WorldBox> boxes, const PairFilter& filter, WorkerThreads& threads,
                            std::uint32_t workers) {
  Status status = BroadPhase::make_tree(boxes, filter, threads, workers, tree_);
  if (status == Status::kOk && !place_of_.resize(boxes.size())) status = Status::kOutOfMemory;
  if (status != Status::kOk) {
    forget();
    return status;
  }
  for (std::uint32_t place = 0; place < boxes.size(); ++place) place_of_[tree_.items[place].box] = place;
  count_ = boxes.size();
  displaced_ = 0;
  return Status::kOk;
}

void DynamicBoxTree::update(std::uint32_t number, const WorldBox& box, const PairFilter& filter) {
  if (number >= place_of_.size()) {
    count_ = std::max<std::size_t>(count_, std::size_t{number} + 1);
    if (count_ - place_of_.size() > kMostAdded) forget();
    return;
  }
  WorldBox now = box;
  BoxTree::Kind kind = BoxTree::Kind::of(filter, number);
  std::size_t place = place_of_[number];
  for (int level = 0; level < tree_.levels; ++level, place /= BoxTree::kGroup) {
    const std::size_t group = tree_.level_begin[level] + place / BoxTree::kGroup, i = place % BoxTree::kGroup;
    const bool out = put(now, i, tree_.groups[group]);
    if (level == 1 && out) ++displaced_;
    now = box_of(tree_.groups[group]);
    if (tree_.kinds.size() == 0) continue;
    tree_.kinds[group].of[i] = kind;
    kind = {};
    for (const BoxTree::Kind& of : tree_.kinds[group].of) kind.add(of);
  }
  if (displaced_ > place_of_.size() / kBoxesForOneDisplaced) forget();
}

}  // namespace tandem
