#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "common/stopwatch.h"
#include "tandem/kernels/distance_query.h"

namespace tandem::bench {

/// How the distances came about: the attributes of a distances file.
struct DistanceRecord {
  std::string backend;
  DistanceTolerance tolerance;
  double reach = 0;
  bool given_pairs = false;
  std::uint64_t threads = 1;
  Seconds seconds;  ///< of each repeat, at least one
  DistanceCounters counters;
};

/// XXH64 of pairs and of lower and upper bounds, one after the other, as a distances file has them.
std::uint64_t hash_of(std::span<const ObjectPair> pairs, std::span<const ObjectDistance> distances);

/// Writes a distances file (docs/scenes.md), whole or not at all. Throws OutputError.
void write_distances(const std::string& path, std::span<const ObjectPair> pairs,
                     std::span<const ObjectDistance> distances, const DistanceRecord& record);

}  // namespace tandem::bench
