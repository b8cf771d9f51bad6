#include <algorithm>
#include <limits>

#include "bvhbuild/meshing/index_table.h"
#include "parallel/parallel.h"
#include "topology.h"
#include "working_tree.h"

namespace tandem::build {
namespace {

constexpr double kImpossible = std::numeric_limits<double>::infinity();

// Blocks that one search looks at, and all searches of a pass, for each child of the region. 20 to 36 on
// ordinary meshes; many more only where large triangles pile up in one place.
constexpr int kMostBlocksSearched = 256;
constexpr std::uint64_t kMostBlocksPerChild = 48;

// An exchange must save this part of what the child's absence would, so that rounding never goes in circles.
constexpr double kLeastSaving = 1e-6;

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits() {
    const std::uint64_t before = state_;
    state_ += kSplitMixStep;
    return split_mix(before);
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

template <typename Bounds>
class Annealing {
 public:
  Annealing(WorkingTree<Bounds>& tree, ExchangeSearch<Bounds>& search, const Region& region)
      : tree_(tree),
        search_(search),
        region_(region),
        random_(region.blocks.size() + region.children.size()) {}

  // Makes one random exchange unless it costs more than about `temperature`.
  void trial(double temperature) {
    const Child child = region_.children[random_.below(static_cast<std::uint32_t>(region_.children.size()))];
    Exchange exchange{child, {}, tree_.parent_of(child), 0};
    if (!choose_partner(exchange)) return;
    const double change = search_.cost_change(exchange, region_);
    if (change < 0 || change < temperature * random_.exponential()) tree_.apply(exchange, region_.root);
  }

 private:
  // Chooses by going some blocks up from the child's parent, then down again to a block of its kind, which is
  // often where the child fits well.
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

  WorkingTree<Bounds>& tree_;
  ExchangeSearch<Bounds>& search_;
  const Region& region_;
  Random random_;
};

// Improves a region by simulated annealing: random exchanges between neighbours, which are also made where
// they cost a little, less and less of it as time goes on. Ends with passes of the search. The region is left
// as it was where that did not make it cheaper, or where it was stopped too early to. Source: Kirkpatrick,
// Gelatt and Vecchi 1983.
template <typename Bounds>
void anneal(WorkingTree<Bounds>& tree, ExchangeSearch<Bounds>& search, const Region& region,
            std::uint32_t trials_per_child, OptimisationWatch& watch) {
  if (region.blocks.size() < 3) return;
  std::vector<typename WorkingTree<Bounds>::Block> before;
  for (const std::uint32_t block : region.blocks) before.push_back(tree[block]);
  const double cost_before = cost_of(tree, region);
  const double mean = cost_before / static_cast<double>(region.blocks.size() - 1);

  Annealing<Bounds> annealing(tree, search, region);
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

// Triangles of a subtree that one thread improves: small enough for a cache, large enough that few exchanges
// would cross its border.
constexpr std::uint32_t kRegionTriangles = 1 << 13;

// Random exchanges that best effort tries, for each child; fewer for large meshes, so that it takes minutes
// and not hours.
constexpr std::uint64_t kTrialsPerChild = 6000, kMostTrials = 1'500'000'000;

// Passes over all that best effort makes at its end; they seldom find anything after the fourth.
constexpr int kMostPasses = 8;

template <typename Bounds>
class Optimiser {
 public:
  Optimiser(const Topology& topology, std::span<const Bounds> bounds, OptimisationWatch& watch)
      : tree_(topology, bounds), search_(tree_), watch_(watch) {}

  // Makes one pass over each region, then one over the blocks above them. is_all: nothing comes after it;
  // else it is too short for a share of its own.
  void exchange_in_regions(bool is_all) {
    const std::vector<Region> regions = cut_into_regions(tree_, kRegionTriangles);
    if (is_all) watch_.expect(children_of(regions));
    const auto pass = [&](ExchangeSearch<Bounds>& search, const Region& region) {
      if (watch_.stop) return;
      search.pass(region);
      watch_.count(is_all ? region.children.size() : 0);
    };
    for_each_below(regions, pass);
    if (has_top(regions)) pass(search_, regions.back());
  }

  void anneal_regions() {
    const std::vector<Region> regions = cut_into_regions(tree_, kRegionTriangles);
    const std::uint64_t children = children_of(regions);
    const std::uint64_t trials =
        std::min(kTrialsPerChild, kMostTrials / std::max<std::uint64_t>(children, 1));
    watch_.expect(trials * children);
    for_each_below(regions, [&](ExchangeSearch<Bounds>& search, const Region& region) {
      anneal(tree_, search, region, static_cast<std::uint32_t>(trials), watch_);
    });
  }

  // Passes over the whole tree at once, until there is nothing left to gain.
  void exchange_everywhere() {
    const Region whole = cut_into_regions(tree_, ~0u).front();
    for (int pass = 0; pass < kMostPasses && !watch_.stop; ++pass) {
      if (search_.pass(whole) == 0) break;
    }
  }

  Topology topology() const { return tree_.topology(); }

 private:
  static std::uint64_t children_of(const std::vector<Region>& regions) {
    std::uint64_t children = 0;
    for (const Region& region : regions) children += region.children.size();
    return children;
  }

  static bool has_top(const std::vector<Region>& regions) { return regions.size() > 1; }

  template <typename Body>
  void for_each_below(const std::vector<Region>& regions, const Body& body) {
    const std::size_t count = regions.size() - has_top(regions);
    parallel::for_each(
        count, [&] { return ExchangeSearch<Bounds>(tree_); },
        [&](ExchangeSearch<Bounds>& search, std::size_t i) { body(search, regions[i]); });
    for (std::size_t i = 0; i < count; ++i) tree_.refresh_heights(regions[i].root);
  }

  WorkingTree<Bounds> tree_;
  ExchangeSearch<Bounds> search_;
  OptimisationWatch& watch_;
};

}  // namespace

template <typename Bounds>
std::uint32_t ExchangeSearch<Bounds>::pass(const Region& region) {
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
// the bound, which loses little (docs/decisions/trees.md) and keeps searches short.
template <typename Bounds>
bool ExchangeSearch<Bounds>::improve(Child child, const Region& region) {
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

template <typename Bounds>
void ExchangeSearch<Bounds>::try_places_of(std::uint32_t block, Exchange exchange, double gain,
                                           Exchange& best, double& least) const {
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

template <typename Bounds>
void ExchangeSearch<Bounds>::descend(const Waiting& at, Child child, double gain) {
  const typename WorkingTree<Bounds>::Block& self = tree_[at.block];
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

template <typename Bounds>
void ExchangeSearch<Bounds>::mark_ancestors(std::uint32_t block, const Region& region) {
  ++stamp_;
  std::uint32_t depth = region.depth;
  for (std::uint32_t b = block; b != region.root; b = tree_[b].parent) ++depth;
  for (std::uint32_t b = block;; b = tree_[b].parent) {
    marks_[b] = {stamp_, depth--};
    if (b == region.root) return;
  }
}

template <typename Bounds>
double ExchangeSearch<Bounds>::cost_change(const Exchange& exchange, const Region& region) {
  if (exchange.first_parent == exchange.second_parent) return kImpossible;
  if (exchange.second.index == kNoIndex && tree_[exchange.first_parent].count < 2) return kImpossible;
  mark_ancestors(exchange.first_parent, region);
  return change_by(exchange, kImpossible);
}

// Condition: the ancestors of the first parent are marked. Gives up where the second parent's side alone
// costs `limit`.
template <typename Bounds>
double ExchangeSearch<Bounds>::change_by(const Exchange& exchange, double limit) const {
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

void OptimisationWatch::count(std::uint64_t units) {
  const std::lock_guard lock(mutex_);
  done_ += units;
  tell(optimised_.at(std::min(1.0, static_cast<double>(done_) / static_cast<double>(expected_))));
}

void OptimisationWatch::reach(double share) {
  const std::lock_guard lock(mutex_);
  done_ = 0;
  tell(share);
}

void OptimisationWatch::tell(double share_of_part) {
  told_ = std::max(told_, part_.at(share_of_part));
  progress(told_);
}

template <typename Bounds>
void optimise(Topology& topology, const std::vector<Bounds>& bounds, Effort effort,
              OptimisationWatch& watch) {
  if (effort == Effort::fast || topology.size() < 3) return;
  Optimiser<Bounds> optimiser(topology, bounds, watch);
  optimiser.exchange_in_regions(effort == Effort::standard);
  if (effort == Effort::best) {
    optimiser.exchange_everywhere();
    optimiser.anneal_regions();
    optimiser.exchange_everywhere();
  }
  topology = optimiser.topology();
}

#define TANDEM_INSTANTIATE(Bounds)       \
  template class ExchangeSearch<Bounds>; \
  template void optimise(Topology&, const std::vector<Bounds>&, Effort, OptimisationWatch&);
TANDEM_FOR_EACH_BOUNDS(TANDEM_INSTANTIATE)
#undef TANDEM_INSTANTIATE

}  // namespace tandem::build
