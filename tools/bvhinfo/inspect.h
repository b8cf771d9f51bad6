#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "level_check.h"
#include "statistics/statistics.h"
#include "statistics/statistics_json.h"
#include "tandem/runtime/map.h"

namespace tandem {

/// A file and everything that bvhinfo knows of it.
struct Inspection {
  std::string path;
  MappedAsset asset;
  Status status = Status::kOk;
  double check_seconds = 0;
  TreeStatistics tree;
  std::vector<ExpectedWork> work;        ///< of each level
  std::optional<SurfaceCounts> surface;  ///< of level 0; nothing where the file has no topology
  Json source;                           ///< the provenance, null if it is no JSON
  std::optional<std::vector<LevelCheck>> level_checks;  ///< where they were asked for and the file is sound
  double level_check_seconds = 0;

  /// The first of the error bounds that does not hold, or null.
  const LevelCheck* wrong_level() const;
  bool is_sound() const { return status == Status::kOk && wrong_level() == nullptr; }
};

/// Says what to look at.
enum class InspectionDepth : std::uint8_t { everything, verify, verify_levels };

/// Opens and checks the file, and measures the tree or verifies the error bounds of its levels, if asked to.
/// The result has a status and nothing else if the checker refuses the file.
Inspection inspect(const std::string& path, InspectionDepth depth);

/// "cow.bvh: a block has two parents (ChildShared, block 17)". Condition: the file is not sound.
std::string defect_of(const Inspection& inspection);

}  // namespace tandem
