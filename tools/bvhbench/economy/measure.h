#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "difference.h"
#include "rest.h"

namespace tandem::economy {

/// A level of detail for each asset of a scene.
using Levels = std::vector<std::uint32_t>;

struct MeasureSettings {
  std::string engine = "tandem";  ///< of make_engine()
  std::uint32_t threads = 1, repeats = 1;
  double simulated_seconds = 0;  ///< 0: nothing is simulated
};

/// The measures that a simulation gives of levels.
struct RestMeasures {
  double step_seconds = 0;  ///< of computing, mean
  double speed = 0;         ///< Rest::speed
  Spread end_distance;      ///< from where the finest levels leave the bodies
};

/// The costs of a scene with its assets at some levels, and what these change against the finest. Assets
/// without instances are left out.
struct Measures {
  Levels levels;
  std::uint64_t bytes = 0;                         ///< of these levels in their files
  std::uint64_t gpu_bytes = 0;                     ///< that the query takes of a GPU; 0 on a CPU
  double query_seconds = 0, manifold_seconds = 0;  ///< the best of the repeats; broad phase included
  std::uint64_t object_pairs = 0, touching_pairs = 0, contacts = 0, manifolds = 0;
  Difference change;  ///< of the object pairs that have an asset at a coarser level: no others can change
  std::optional<RestMeasures> rest;
};

/// Measures a scene at levels of its assets. Levels that its file tells are not looked at.
class LevelMeasurer {
 public:
  /// Throws bench::FileError.
  LevelMeasurer(std::string path, const MeasureSettings& settings);

  /// Its instances are of rows of `shapes`, the assets that have instances.
  const bench::LoadedScene& scene() const { return scene_; }

  /// Returns the asset of each instance.
  const std::vector<std::uint32_t>& asset_of() const { return asset_of_; }

  /// Returns how many levels each asset has; 1 of an asset that the scene has no instance of.
  std::vector<std::uint32_t> level_counts() const;

  /// Measures levels once and remembers them; the finest come first. Throws bench::FileError, EngineError,
  /// GpuError.
  const Measures& measure(const Levels& levels);

  /// Returns the name of the GPU, once something was measured on one.
  const std::string& gpu() const { return gpu_; }

  /// Returns how far from each other the finest levels leave bodies that start kNudge diagonals apart: what a
  /// chaotic scene makes of next to nothing.
  const Spread& end_distance_of_a_nudge();
  static constexpr double kNudge = 1e-6;

 private:
  Measures query(const Levels& levels);
  Findings changeable(const Findings& found, const Levels& levels) const;
  void use(const Levels& levels);
  SimulationSettings simulation() const;

  std::string path_, gpu_;
  MeasureSettings settings_;
  bench::LoadedScene scene_;
  std::vector<std::uint32_t> asset_of_;  // of each instance
  std::vector<std::uint32_t> used_;      // the assets that have instances, ascending
  Findings finest_, found_;              // of the finest levels; of the last query
  Rest finest_rest_;
  std::optional<Spread> nudged_;
  std::map<Levels, Measures> known_;
};

}  // namespace tandem::economy
