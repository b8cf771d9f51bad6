#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/report.h"
#include "timed_work.h"

namespace tandem::bench {

/// Pairs of bodies with more triangles than that, in all, are not given to the reference, which would take
/// hours.
inline constexpr std::uint64_t kMostReferenceTriangles = 10'000'000;

/// The results of one library for the distances of a scene.
struct DistancePeer : PeerTimes {
  double worst_error = 0;  ///< how far beyond the certified interval, relative to it, in the worst pair
  std::optional<std::uint64_t> outside;  ///< of the reference: intervals that do not hold its exact distance
};

/// The distances of a scene's bodies through all libraries, same object pairs, one thread, side by side. The
/// reference runs once, and only where the pairs have kMostReferenceTriangles in all at most.
struct DistanceComparison {
  std::string name;  ///< of the scene file, without folder and ending
  double reach = 0;
  std::uint64_t instances = 0, object_pairs = 0;
  std::vector<DistancePeer> peers;
};

/// Asks for the distances of those pairs that are apart and within reach, by Tandem's certified intervals.
/// Throws FileError of a scene that cannot be compared, std::runtime_error of a library.
DistanceComparison compare_distances(const std::string& path, double reach, unsigned repeats);

/// Makes the report, whose text has a line for each library.
Report report_of(const DistanceComparison& comparison);

}  // namespace tandem::bench
