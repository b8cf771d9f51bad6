#include "optimise.h"

#include <algorithm>

#include "anneal.h"
#include "exchange_search.h"
#include "parallel/parallel.h"
#include "region.h"

namespace tandem::build {
namespace {

// Triangles of a subtree that one thread improves: small enough for a cache, large enough that few exchanges
// would cross its border.
constexpr std::uint32_t kRegionTriangles = 1 << 13;

// Random exchanges that best effort tries, for each child; fewer for large meshes, so that it takes minutes
// and not hours.
constexpr std::uint64_t kTrialsPerChild = 6000, kMostTrials = 1'500'000'000;

// Passes over all that best effort makes at its end; they seldom find anything after the fourth.
constexpr int kMostPasses = 8;

class Optimiser {
 public:
  Optimiser(const Topology& topology, std::span<const Bounds> bounds, OptimisationWatch& watch)
      : tree_(topology, bounds), search_(tree_), watch_(watch) {}

  // One pass over each region, then over the blocks above them. is_all: nothing comes after it; else it is
  // too short for a share of its own.
  void exchange_in_regions(bool is_all) {
    const std::vector<Region> regions = cut_into_regions(tree_, kRegionTriangles);
    if (is_all) {
      std::uint64_t children = 0;
      for (const Region& region : regions) children += region.children.size();
      watch_.expect(children);
    }
    const auto pass = [&](ExchangeSearch& search, const Region& region) {
      if (watch_.stop) return;
      search.pass(region);
      watch_.count(is_all ? region.children.size() : 0);
    };
    for_each_below(regions, pass);
    if (has_top(regions)) pass(search_, regions.back());
  }

  void anneal_regions() {
    const std::vector<Region> regions = cut_into_regions(tree_, kRegionTriangles);
    std::uint64_t children = 0;
    for (const Region& region : regions) children += region.children.size();
    const std::uint64_t trials =
        std::min(kTrialsPerChild, kMostTrials / std::max<std::uint64_t>(children, 1));
    watch_.expect(trials * children);
    for_each_below(regions, [&](ExchangeSearch& search, const Region& region) {
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
  static bool has_top(const std::vector<Region>& regions) { return regions.size() > 1; }

  template <typename Body>
  void for_each_below(const std::vector<Region>& regions, const Body& body) {
    const std::size_t count = regions.size() - has_top(regions);
    parallel::for_each(
        count, [&] { return ExchangeSearch(tree_); },
        [&](ExchangeSearch& search, std::size_t i) { body(search, regions[i]); });
    for (std::size_t i = 0; i < count; ++i) tree_.refresh_heights(regions[i].root);
  }

  WorkingTree tree_;
  ExchangeSearch search_;
  OptimisationWatch& watch_;
};

}  // namespace

void OptimisationWatch::count(std::uint64_t units) {
  const std::lock_guard lock(mutex_);
  done_ += units;
  progress(std::min(1.0, static_cast<double>(done_) / static_cast<double>(expected_)));
}

void optimise(Topology& topology, std::span<const Bounds> bounds, Effort effort, OptimisationWatch& watch) {
  if (effort == Effort::fast || topology.size() < 3) return;
  Optimiser optimiser(topology, bounds, watch);
  optimiser.exchange_in_regions(effort == Effort::standard);
  if (effort == Effort::best) {
    optimiser.exchange_everywhere();
    optimiser.anneal_regions();
    optimiser.exchange_everywhere();
  }
  topology = optimiser.topology();
}

}  // namespace tandem::build
