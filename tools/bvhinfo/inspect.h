#pragma once
#include <string>

#include "statistics/statistics_json.h"
#include "tandem/runtime/map.h"

namespace tandem {

/// One file and everything that bvhinfo knows of it.
struct Inspection {
  std::string path;
  MappedAsset asset;
  Status status = Status::kOk;
  double check_seconds = 0;
  TreeStatistics tree;
  ExpectedWork work;
  Json source;  ///< the provenance, null if it is no JSON
};

/// Opens and checks the file; measures the tree unless `only_verify`. A file that is not sound has a status
/// and nothing else.
Inspection inspect(const std::string& path, bool only_verify);

/// "cow.bvh: a block has two parents (ChildShared, block 17)". Condition: the status is not kOk.
std::string defect_of(const Inspection& inspection);

}  // namespace tandem
