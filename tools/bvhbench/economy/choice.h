#pragma once
#include <functional>
#include <vector>

#include "measure.h"

/// These functions choose levels that are enough.
namespace tandem::economy {

/// Measures a scene at some levels.
using Measure = std::function<const Measures&(const Levels&)>;

/// The data from which a choice is made.
struct Candidates {
  std::vector<std::vector<double>> error_bounds;  ///< [asset][level], ascending, lengths
  std::vector<std::uint32_t> asset_of;            ///< of each instance
  Measure measure;

  std::size_t assets() const { return error_bounds.size(); }

  /// The asset at this level, all others at their finest.
  Levels alone(std::size_t asset, std::uint32_t level) const;

  /// Returns the levels with all assets at their coarsest.
  Levels coarsest() const;
};

/// Returns for each asset that part of its diagonal, but at most of the smallest diagonal of those that move:
/// a large asset, such as a ground, is judged by what lies on it.
std::vector<double> tolerances_of(double part, const std::vector<double>& diagonals,
                                  const std::vector<bool>& moves);

/// Returns for each asset the coarsest level whose error bound is at most the asset's tolerance, a length,
/// and that alone keeps half of the depths of the object pairs with the asset within the smaller tolerance of
/// the pair's two assets. Then as many finer levels, always at the asset whose error bound is the largest
/// part of its tolerance among those that break this and those that they meet, as it takes until each keeps
/// it at the levels of all together.
Levels within_tolerance(const Candidates& candidates, const std::vector<double>& tolerance);

/// Levels whose cost is at most the budget, or the cheapest if none is so cheap: from the finest on always
/// the coarser level of an asset that adds least to the error bound for what it saves, alone; at last all at
/// their coarsest.
Levels within_budget(const Candidates& candidates, double budget,
                     const std::function<double(const Measures&)>& cost);

}  // namespace tandem::economy
