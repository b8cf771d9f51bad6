#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "tandem/kernels/broad_phase.h"

namespace tandem {

/// A tree of world boxes that follows those that change: it makes a leaf and the groups over it anew, in
/// O(log n). Boxes that were added later are in no leaf, and are visited one by one. A tree whose boxes have
/// left their neighbours is worn out, and is made anew.
class DynamicBoxTree {
 public:
  bool is_made() const { return tree_.items.size() != 0; }

  /// Makes a tree of all boxes. Result: as of BroadPhase::make_tree(); after an error there is none.
  Status make(std::span<const WorldBox> boxes, const PairFilter& filter, WorkerThreads& threads,
              std::uint32_t workers);

  void forget() { tree_.clear(); }

  /// Takes the box that this number has now, and what the filter says of it now. Where the tree is worn out,
  /// there is none any more. Condition: a tree; numbers that are new are added one after the other.
  void update(std::uint32_t number, const WorldBox& box, const PairFilter& filter);

  /// Calls visit(other) for each box that meets this one and that the filter may look at from `number`, and
  /// maybe for others. Condition: a tree.
  template <typename Visit>
  void visit(std::uint32_t number, const WorldBox& box, const PairFilter& filter, const Visit& visit) const {
    const BoxTree::Kind kind = BoxTree::Kind::of(filter, number);
    tree_.visit(box, &kind, visit);
    for (std::size_t other = place_of_.size(); other < count_; ++other)
      visit(static_cast<std::uint32_t>(other));
  }

 private:
  BoxTree tree_;
  Buffer<std::uint32_t> place_of_;  // of each box that the tree was made of
  std::size_t count_ = 0;           // of all boxes
  std::size_t displaced_ = 0;       // boxes that have left the group that they were in
};

}  // namespace tandem
