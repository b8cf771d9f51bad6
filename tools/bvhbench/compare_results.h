#pragma once
#include <string>
#include <vector>

#include "common/report.h"
#include "compare.h"

namespace tandem::bench {

/// The results of `bvhbench compare`, and where they were found.
struct CompareResults {
  std::string machine;  ///< the processor's name
  std::string commit;   ///< $TANDEM_COMMIT, or empty
  unsigned repeats;
  std::vector<SceneComparison> scenes;
};

/// Makes the report: its JSON has the stable keys of docs/comparison.md, its text is a table for people.
Report report_of(const SceneComparison& comparison);

/// Writes the HDF5 file of docs/comparison.md, whole or not at all. Throws OutputError.
void write_results(const std::string& path, const CompareResults& results);

}  // namespace tandem::bench
