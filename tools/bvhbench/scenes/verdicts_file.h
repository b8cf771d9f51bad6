#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "common/stopwatch.h"
#include "tandem/kernels/tolerance_query.h"

namespace tandem::bench {

/// How the verdicts came about: the attributes of a verdicts file.
struct VerdictRecord {
  std::string backend;
  double tolerance = 0;
  bool given_pairs = false;
  std::uint64_t threads = 1;
  Seconds seconds;  ///< of each repeat, at least one
  ToleranceCounters counters;
};

/// XXH64 of pairs and verdicts, one after the other, as a verdicts file has them.
std::uint64_t hash_of(std::span<const ObjectPair> pairs, std::span<const PairVerdict> verdicts);

/// Writes a verdicts file (docs/scenes.md), whole or not at all. Throws OutputError.
void write_verdicts(const std::string& path, std::span<const ObjectPair> pairs,
                    std::span<const PairVerdict> verdicts, const VerdictRecord& record);

}  // namespace tandem::bench
