#pragma once
#include <string>
#include <vector>

#include "common/json.h"
#include "compare.h"

namespace tandem::bench {

/// What `bvhbench compare` found, and where.
struct CompareResults {
  std::string machine;  ///< the processor's name
  std::string commit;   ///< $TANDEM_COMMIT, or empty
  unsigned repeats;
  std::vector<SceneComparison> scenes;
};

/// Under the stable keys of docs/comparison.md.
Json to_json(const CompareResults& results);

/// A table for people.
std::string to_text(const SceneComparison& comparison);

/// Writes the HDF5 file of docs/comparison.md, whole or not at all. Throws OutputError.
void write_results(const std::string& path, const CompareResults& results);

}  // namespace tandem::bench
