#include "anneal.h"

#include <algorithm>

namespace tandem::build {
namespace {

// SplitMix64 (Steele, Lea and Flood 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
  }
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>((bits() >> 32) * n >> 32); }
  // Nearly exponential with mean 1, of +, -, * and / alone, so that every machine draws the same:
  // -ln(1 - u) = u (6 - u) / (6 - 4u) to third order.
  double exponential() {
    const double u = static_cast<double>(bits() >> 11) * 0x1p-53;
    return u * (6 - u) / (6 - 4 * u);
  }

 private:
  std::uint64_t state_;
};

// The first temperature, in mean costs of a block: hotter ones lose with so few trials.
constexpr double kHottest = 0.15;

class Annealing {
 public:
  Annealing(WorkingTree& tree, ExchangeSearch& search, const Region& region)
      : tree_(tree),
        search_(search),
        region_(region),
        random_(region.blocks.size() + region.children.size()) {}

  // One random exchange, made unless it costs more than about `temperature`.
  void trial(double temperature) {
    const Child child = region_.children[random_.below(static_cast<std::uint32_t>(region_.children.size()))];
    Exchange exchange{child, {}, tree_.parent_of(child), 0};
    if (!choose_partner(exchange)) return;
    const double change = search_.cost_change(exchange, region_);
    if (change < 0 || change < temperature * random_.exponential()) tree_.apply(exchange, region_.root);
  }

 private:
  // Some blocks up from the child's parent, then down again to a block of its kind, which is often where the
  // child fits well.
  bool choose_partner(Exchange& exchange) {
    std::uint32_t block = exchange.first_parent;
    for (int up = 0; up < kMostUp && block != region_.root && (up == 0 || random_.below(4) != 0); ++up) {
      block = tree_[block].parent;
    }
    while (tree_[block].is_leaf_block != exchange.first.is_triangle || block == exchange.first_parent ||
           (!exchange.first.is_triangle && random_.below(4) != 0)) {
      if (tree_[block].is_leaf_block) return false;
      const std::uint32_t a = random_child(block), b = random_child(block);
      const std::uint32_t next = a == b || growth(a, exchange.first) < growth(b, exchange.first) ? a : b;
      if (!exchange.first.is_triangle) {
        if (next == exchange.first.index) return false;
        if (tree_[next].is_leaf_block) break;
      }
      block = next;
    }
    exchange.second_parent = block;
    const int count = tree_[block].count;
    const auto place =
        static_cast<int>(random_.below(static_cast<std::uint32_t>(std::min(count + 1, kNodesPerBlock))));
    exchange.second = place < count ? tree_.child(block, place) : Child{kNoIndex, exchange.first.is_triangle};
    return true;
  }

  std::uint32_t random_child(std::uint32_t block) {
    return tree_[block].child[random_.below(tree_[block].count)];
  }

  double growth(std::uint32_t block, Child child) const {
    Bounds grown = tree_[block].box;
    grown.grow(tree_.bounds_of(child));
    return double{grown.visit_cost()} - double{tree_[block].box.visit_cost()};
  }

  static constexpr int kMostUp = 6;

  WorkingTree& tree_;
  ExchangeSearch& search_;
  const Region& region_;
  Random random_;
};

double cost_of(const WorkingTree& tree, const Region& region) {
  double cost = 0;
  for (const std::uint32_t block : region.blocks) {
    if (block != region.root) cost += double{tree[block].box.visit_cost()};
  }
  return cost;
}

}  // namespace

void anneal(WorkingTree& tree, ExchangeSearch& search, const Region& region, std::uint32_t trials_per_child,
            OptimisationWatch& watch) {
  if (region.blocks.size() < 3) return;
  std::vector<WorkingTree::Block> before;
  for (const std::uint32_t block : region.blocks) before.push_back(tree[block]);
  const double cost_before = cost_of(tree, region);
  const double mean = cost_before / static_cast<double>(region.blocks.size() - 1);

  Annealing annealing(tree, search, region);
  const std::uint64_t trials = std::uint64_t{trials_per_child} * region.children.size();
  const double hottest = mean * kHottest;
  constexpr std::uint64_t kChunk = 1 << 14;
  for (std::uint64_t done = 0; done < trials && !watch.stop; done += kChunk) {
    const double left = 1 - static_cast<double>(done) / static_cast<double>(trials);
    for (std::uint64_t i = 0; i < kChunk; ++i) annealing.trial(hottest * left * left);
    watch.count(kChunk);
  }
  for (int pass = 0; pass < 4 && search.pass(region) > 0; ++pass) {
  }
  if (!(cost_of(tree, region) < cost_before)) tree.restore(region.blocks, before);
}

}  // namespace tandem::build
