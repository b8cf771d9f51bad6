#include "exchange_search.h"

#include <algorithm>
#include <limits>

namespace tandem::build {
namespace {

constexpr double kImpossible = std::numeric_limits<double>::infinity();

// Blocks that one search looks at, and all searches of a pass, for each child of the region. 20 to 36 on
// ordinary meshes; many more only where large triangles pile up in one place.
constexpr int kMostBlocksSearched = 256;
constexpr std::uint64_t kMostBlocksPerChild = 48;

// An exchange must save this part of what the child's absence would, so that rounding never goes in circles.
constexpr double kLeastSaving = 1e-6;

}  // namespace

std::uint32_t ExchangeSearch::pass(const Region& region) {
  const std::uint64_t budget = kMostBlocksPerChild * region.children.size();
  std::uint32_t made = 0;
  searched_ = 0;
  for (const Child child : region.children) {
    if (searched_ > budget) break;
    made += improve(child, region);
  }
  return made;
}

// Branch and bound after Bittner, Hapala and Havran 2013, for an exchange instead of an insertion: what is
// saved is at most what the child's absence saves, plus what its partner's does; the latter is left out of
// the bound, which loses little (docs/decisions/0033) and keeps searches short.
bool ExchangeSearch::improve(Child child, const Region& region) {
  const std::uint32_t parent = tree_.parent_of(child);
  if (tree_[parent].count < 2) return false;
  const double gain = -tree_.cost_change(parent, child.index, Bounds(), region.root);
  if (!(gain > 0)) return false;
  mark_ancestors(parent, region);
  Exchange best;
  double least = -kLeastSaving * gain;
  waiting_.assign(1, {region.root, 0});
  for (int searched = 0; !waiting_.empty() && searched < kMostBlocksSearched; ++searched, ++searched_) {
    const Waiting at = waiting_.back();
    waiting_.pop_back();
    if (tree_[at.block].is_leaf_block == child.is_triangle && at.block != parent) {
      try_places_of(at.block, {child, {}, parent, at.block}, gain, best, least);
    }
    descend(at, child, gain);
  }
  if (best.first.index == kNoIndex) return false;
  tree_.apply(best, region.root);
  return true;
}

void ExchangeSearch::try_places_of(std::uint32_t block, Exchange exchange, double gain, Exchange& best,
                                   double& least) const {
  const int places = std::min(tree_[block].count + 1, kNodesPerBlock);
  for (int i = 0; i < places; ++i) {
    exchange.second =
        i < tree_[block].count ? tree_.child(block, i) : Child{kNoIndex, exchange.first.is_triangle};
    const double change = change_by(exchange, gain);
    if (change < least) {
      least = change;
      best = exchange;
    }
  }
}

void ExchangeSearch::descend(const Waiting& at, Child child, double gain) {
  const WorkingTree::Block& self = tree_[at.block];
  for (int i = 0; i < self.count && !self.is_leaf_block; ++i) {
    const std::uint32_t next = self.child[i];
    if (!child.is_triangle && (next == child.index || tree_[next].is_leaf_block)) continue;
    double growth = at.growth;
    if (!is_marked(next)) {
      Bounds grown = tree_[next].box;
      grown.grow(tree_.bounds_of(child));
      growth += double{grown.visit_cost()} - double{tree_[next].box.visit_cost()};
    }
    if (growth < gain) waiting_.push_back({next, growth});
  }
}

void ExchangeSearch::mark_ancestors(std::uint32_t block, const Region& region) {
  ++stamp_;
  std::uint32_t depth = region.depth;
  for (std::uint32_t b = block; b != region.root; b = tree_[b].parent) ++depth;
  for (std::uint32_t b = block;; b = tree_[b].parent) {
    marks_[b] = {stamp_, depth--};
    if (b == region.root) return;
  }
}

double ExchangeSearch::cost_change(const Exchange& exchange, const Region& region) {
  if (exchange.first_parent == exchange.second_parent) return kImpossible;
  if (exchange.second.index == kNoIndex && tree_[exchange.first_parent].count < 2) return kImpossible;
  mark_ancestors(exchange.first_parent, region);
  return change_by(exchange, kImpossible);
}

// Condition: the ancestors of the first parent are marked. Gives up where the second parent's side alone
// costs `limit`.
double ExchangeSearch::change_by(const Exchange& exchange, double limit) const {
  const bool blocks = !exchange.first.is_triangle, both = exchange.second.index != kNoIndex;
  if (blocks && both && is_marked(exchange.second.index)) return kImpossible;
  std::uint32_t common = exchange.second_parent, below_common = 0;
  for (; !is_marked(common); common = tree_[common].parent, ++below_common) {
    if (blocks && common == exchange.first.index) return kImpossible;
  }
  if (blocks) {
    const std::uint32_t first_depth = marks_[exchange.first_parent].depth,
                        second_depth = marks_[common].depth + below_common;
    if (second_depth + tree_[exchange.first.index].height > kMaxDepth) return kImpossible;
    if (both && first_depth + tree_[exchange.second.index].height > kMaxDepth) return kImpossible;
  }
  const double change = tree_.cost_change(exchange.second_parent, exchange.second.index,
                                          tree_.bounds_of(exchange.first), common);
  if (change >= limit) return kImpossible;
  return change + tree_.cost_change(exchange.first_parent, exchange.first.index,
                                    both ? tree_.bounds_of(exchange.second) : Bounds(), common);
}

}  // namespace tandem::build
