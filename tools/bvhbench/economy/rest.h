#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bvhbench/scenes/scene_file.h"
#include "difference.h"
#include "dynamics/linear.h"

namespace tandem::economy {

/// The settings of a simulation: by default those of `bvhbench simulate`.
struct SimulationSettings {
  std::string engine = "tandem";
  double seconds = 0;
  double nudge =
      0;  ///< each moving body starts as far from its place in some direction, in diagonals of its asset
  std::uint32_t threads = 1;
};

/// The places where the moving bodies of a scene come to rest.
struct Rest {
  double step_seconds = 0;                   ///< of computing, mean over the steps
  double speed = 0;                          ///< of the fastest body, mean over the last tenth of the steps
  std::vector<dynamics::Vector3> positions;  ///< of the centres of mass at the end
};

/// Simulates a scene at its shapes' levels. Throws bench::FileError, and what the engine throws.
Rest simulate(const std::string& path, const bench::LoadedScene& scene, const SimulationSettings& settings);

/// Returns how far from each other two runs leave each moving body. Condition: they are of the same scene.
Spread end_distance(const Rest& a, const Rest& b);

}  // namespace tandem::economy
