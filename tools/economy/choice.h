#pragma once
#include <functional>
#include <vector>

#include "measure.h"

/// Which levels are enough.
namespace tandem::economy {

/// What is measured of a scene at some levels.
using Measure = std::function<const Measures&(const Levels&)>;

/// What a choice is made from.
struct Candidates {
  std::vector<std::vector<double>> error_bounds;  ///< [asset][level], ascending, lengths
  Measure measure;

  std::size_t assets() const { return error_bounds.size(); }

  /// The asset at this level, all others at their finest.
  Levels alone(std::size_t asset, std::uint32_t level) const;
};

/// For each asset the coarsest level whose error bound is at most the asset's tolerance, a length, and that
/// alone changes half of the depths by no more. Then as many finer levels, at the asset whose error bound is
/// the largest part of its tolerance, as it takes until all together change half of the depths by no more
/// than the largest tolerance.
Levels within_tolerance(const Candidates& candidates, const std::vector<double>& tolerance);

/// Levels whose cost is at most the budget, or the cheapest if none is so cheap: from the finest on always
/// the coarser level of an asset that adds least to the error bound for what it saves.
Levels within_budget(const Candidates& candidates, double budget,
                     const std::function<double(const Measures&)>& cost);

}  // namespace tandem::economy
