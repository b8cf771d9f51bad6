#include "choice.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace tandem::economy {
namespace {

// Another level of one asset.
struct Change {
  std::size_t asset;
  std::uint32_t level;
};

using Tolerances = std::vector<double>;

// Returns for each asset whether it is at a coarser level and more than half of the depths of pairs with it
// change by more than they may.
std::vector<bool> broken(const Candidates& candidates, const Levels& levels, const Tolerances& tolerance) {
  std::vector<std::size_t> all(candidates.assets()), within(candidates.assets());
  for (const auto& [pair, by] : candidates.measure(levels).change.depths) {
    const std::uint32_t a = candidates.asset_of[pair.a], b = candidates.asset_of[pair.b];
    const bool keeps = by <= std::min(tolerance[a], tolerance[b]);
    ++all[a], within[a] += keeps;
    if (a != b) ++all[b], within[b] += keeps;
  }
  std::vector<bool> assets(candidates.assets());
  for (std::size_t i = 0; i < assets.size(); ++i) assets[i] = levels[i] > 0 && 2 * within[i] < all[i];
  return assets;
}

// The asset, not at its finest level, whose error bound is the largest part of its tolerance, of those that
// can be to blame: broken ones and those that they meet. None where nothing is broken.
std::optional<std::size_t> loosest(const Candidates& candidates, const Levels& levels,
                                   const Tolerances& tolerance) {
  const std::vector<bool> is_broken = broken(candidates, levels, tolerance);
  std::vector<bool> is_suspect(candidates.assets());
  for (const DepthChange& depth : candidates.measure(levels).change.depths) {
    const std::uint32_t a = candidates.asset_of[depth.pair.a], b = candidates.asset_of[depth.pair.b];
    if (is_broken[a] || is_broken[b]) is_suspect[a] = is_suspect[b] = true;
  }
  std::optional<std::size_t> found;
  double most = -1;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    if (levels[i] == 0 || !is_suspect[i]) continue;
    const double bound = candidates.error_bounds[i][levels[i]];
    const double part = bound == 0 ? 0 : bound / tolerance[i];
    if (part > most) most = part, found = i;
  }
  return found;
}

std::optional<Change> best_saving(const Candidates& candidates, const Levels& levels,
                                  const std::function<double(const Measures&)>& cost) {
  std::optional<Change> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const std::vector<double>& bounds = candidates.error_bounds[i];
    const double now = cost(candidates.measure(candidates.alone(i, levels[i])));
    for (std::uint32_t level = levels[i] + 1; level < bounds.size(); ++level) {
      const double saved = now - cost(candidates.measure(candidates.alone(i, level)));
      if (saved <= 0) continue;
      const double price = (bounds[level] - bounds[levels[i]]) / saved;
      if (price < least) least = price, best = Change{i, level};
    }
  }
  return best;
}

}  // namespace

Levels Candidates::coarsest() const {
  Levels levels;
  for (const std::vector<double>& bounds : error_bounds)
    levels.push_back(static_cast<std::uint32_t>(bounds.size() - 1));
  return levels;
}

Levels Candidates::alone(std::size_t asset, std::uint32_t level) const {
  Levels levels(assets());
  levels[asset] = level;
  return levels;
}

std::vector<double> tolerances_of(double part, const std::vector<double>& diagonals,
                                  const std::vector<bool>& moves) {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < diagonals.size(); ++i) {
    if (moves[i]) smallest = std::min(smallest, diagonals[i]);
  }
  std::vector<double> tolerances;
  for (const double diagonal : diagonals) tolerances.push_back(part * std::min(diagonal, smallest));
  return tolerances;
}

Levels within_tolerance(const Candidates& candidates, const std::vector<double>& tolerance) {
  Levels levels(candidates.assets());
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const std::vector<double>& bounds = candidates.error_bounds[i];
    for (std::uint32_t level = 1; level < bounds.size() && bounds[level] <= tolerance[i]; ++level) {
      if (!broken(candidates, candidates.alone(i, level), tolerance)[i]) levels[i] = level;
    }
  }
  while (const std::optional<std::size_t> asset = loosest(candidates, levels, tolerance)) --levels[*asset];
  return levels;
}

Levels within_budget(const Candidates& candidates, double budget,
                     const std::function<double(const Measures&)>& cost) {
  Levels levels(candidates.assets()), cheapest = levels;
  const auto keep_cheaper = [&](const Levels& other) {
    if (cost(candidates.measure(other)) < cost(candidates.measure(cheapest))) cheapest = other;
  };
  while (cost(candidates.measure(levels)) > budget) {
    const std::optional<Change> change = best_saving(candidates, levels, cost);
    if (!change) {
      keep_cheaper(candidates.coarsest());
      return cheapest;
    }
    levels[change->asset] = change->level;
    keep_cheaper(levels);
  }
  return levels;
}

}  // namespace tandem::economy
