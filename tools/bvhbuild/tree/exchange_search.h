#pragma once
#include <cstdint>
#include <vector>

#include "working_tree.h"

namespace tandem::build {

/// Finds exchanges that make a subtree cheaper. Each thread has its own; they may work on different regions
/// of one tree.
class ExchangeSearch {
 public:
  explicit ExchangeSearch(WorkingTree& tree) : tree_(tree), marks_(tree.size()) {}

  /// For each child in turn, makes the exchange with another one below the region's root that saves most;
  /// ends early where searches take far longer than they do on ordinary meshes.
  /// Result: how many were made.
  std::uint32_t pass(const Region& region);

  /// How the cost of the tree changes by an exchange; infinity where it is not possible: both have the same
  /// parent, one lies below the other, the tree would become too deep, or a block empty.
  double cost_change(const Exchange& exchange, const Region& region);

 private:
  struct Mark {
    std::uint32_t stamp = 0, depth = 0;
  };
  struct Waiting {
    std::uint32_t block;
    double growth;  // what it costs that block and those above it to take the child in
  };

  bool improve(Child child, const Region& region);
  void try_places_of(std::uint32_t block, Exchange exchange, double gain, Exchange& best,
                     double& least) const;
  void descend(const Waiting& at, Child child, double gain);
  void mark_ancestors(std::uint32_t block, const Region& region);
  bool is_marked(std::uint32_t block) const { return marks_[block].stamp == stamp_; }
  double change_by(const Exchange& exchange, double limit) const;

  WorkingTree& tree_;
  std::vector<Mark> marks_;  // of the first parent and the blocks above it
  std::uint32_t stamp_ = 0;
  std::vector<Waiting> waiting_;
  std::uint64_t searched_ = 0;  // blocks, by the present pass
};

}  // namespace tandem::build
