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

// The asset, not at its finest level, whose error bound is the largest part of its tolerance.
std::size_t loosest(const Candidates& candidates, const Levels& levels,
                    const std::vector<double>& tolerance) {
  std::size_t found = 0;
  double most = -1;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    if (levels[i] == 0) continue;
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

Levels Candidates::alone(std::size_t asset, std::uint32_t level) const {
  Levels levels(assets());
  levels[asset] = level;
  return levels;
}

Levels within_tolerance(const Candidates& candidates, const std::vector<double>& tolerance) {
  Levels levels(candidates.assets());
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const std::vector<double>& bounds = candidates.error_bounds[i];
    for (std::uint32_t level = 1; level < bounds.size() && bounds[level] <= tolerance[i]; ++level) {
      if (candidates.measure(candidates.alone(i, level)).change.depth.median <= tolerance[i])
        levels[i] = level;
    }
  }
  const double largest = tolerance.empty() ? 0 : *std::max_element(tolerance.begin(), tolerance.end());
  const auto is_finest = [&] {
    return std::all_of(levels.begin(), levels.end(), [](std::uint32_t level) { return level == 0; });
  };
  while (!is_finest() && candidates.measure(levels).change.depth.median > largest)
    --levels[loosest(candidates, levels, tolerance)];
  return levels;
}

Levels within_budget(const Candidates& candidates, double budget,
                     const std::function<double(const Measures&)>& cost) {
  Levels levels(candidates.assets()), cheapest = levels;
  while (cost(candidates.measure(levels)) > budget) {
    const std::optional<Change> change = best_saving(candidates, levels, cost);
    if (!change) return cheapest;
    levels[change->asset] = change->level;
    if (cost(candidates.measure(levels)) < cost(candidates.measure(cheapest))) cheapest = levels;
  }
  return levels;
}

}  // namespace tandem::economy
