#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/json.h"
#include "common/stopwatch.h"

namespace tandem::bench {

/// What one library did for the distances of a scene.
struct DistancePeer {
  std::string name, settings;
  double build_seconds = 0;  ///< once
  Seconds query_seconds;     ///< each repeat
  double worst_error = 0;    ///< how far beyond the certified interval, relative to it, in the worst pair
};

/// The distances of a scene's bodies through all libraries, same object pairs, one thread, side by side.
struct DistanceComparison {
  std::string name;  ///< of the scene file, without folder and ending
  double reach = 0;
  std::uint64_t instances = 0, object_pairs = 0;
  std::vector<DistancePeer> peers;
};

/// Asks for the distances of those pairs that are apart and within reach, by Tandem's certified intervals.
/// Throws FileError of a scene that cannot be compared, std::runtime_error of a library.
DistanceComparison compare_distances(const std::string& path, double reach, unsigned repeats);

std::string to_text(const DistanceComparison& comparison);
Json to_json(const DistanceComparison& comparison);

}  // namespace tandem::bench
