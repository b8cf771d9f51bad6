#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bvhbench/economy/measure.h"
#include "command.h"

namespace tandem::bench {

/// The arguments of `bvhbench economy`: one of the three limits.
struct EconomyArguments : CommonArguments {
  EconomyArguments() { repeats = 3; }

  std::optional<double> tolerance;     ///< a length, or a part of diagonals
  bool relative = false;               ///< which of these
  std::optional<double> milliseconds;  ///< of query and manifolds, or of a simulated step
  std::optional<std::uint64_t> bytes;  ///< of all levels, or of GPU memory
  double simulated_seconds = 0;        ///< 0: nothing is simulated
};

/// The findings about one asset.
struct AssetEconomy {
  std::string name;
  double diagonal = 0;
  std::uint64_t instances = 0;
  bool moves = false;               ///< some instance does
  std::optional<double> tolerance;  ///< a length, where a tolerance is the limit
  std::vector<LevelView> levels;
  std::vector<economy::Measures> measures;  ///< of each level, the other assets at their finest
};

struct EconomyResult {
  std::string gpu;  ///< its name, or empty
  std::vector<AssetEconomy> assets;
  economy::Measures finest, recommended;
  bool within = true;  ///< the limit; a budget can be too small for the coarsest levels
  std::optional<economy::Spread> nudged;
};

/// Returns the seconds of query and manifolds, or of a simulated step where there is one.
double seconds_of(const economy::Measures& measures);

/// Returns the memory of the query on the GPU, or else of the levels.
std::uint64_t memory_of(const economy::Measures& measures);

/// Makes the report, whose text has a table for each asset, and says what is recommended and lost by it.
Report report_of(const EconomyArguments& arguments, const EconomyResult& result);

}  // namespace tandem::bench
