#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "statistics/statistics_json.h"
#include "tandem/runtime/map.h"

namespace tandem {

/// What the topology of a level says.
struct SurfaceCounts {
  std::uint64_t vertices = 0, components = 0, closed_components = 0;
  std::uint64_t turned_triangles = 0;
  std::uint64_t boundary_edges = 0;
  std::uint64_t sides_at_edges_of_many = 0;  ///< sides of triangles at edges of more than two
};

/// One file and everything that bvhinfo knows of it.
struct Inspection {
  std::string path;
  MappedAsset asset;
  Status status = Status::kOk;
  double check_seconds = 0;
  TreeStatistics tree;
  ExpectedWork work;
  std::optional<SurfaceCounts> surface;  ///< of level 0; nothing where the file has no topology
  Json source;                           ///< the provenance, null if it is no JSON
};

/// Opens and checks the file; measures the tree unless `only_verify`. A file that is not sound has a status
/// and nothing else.
Inspection inspect(const std::string& path, bool only_verify);

/// "cow.bvh: a block has two parents (ChildShared, block 17)". Condition: the status is not kOk.
std::string defect_of(const Inspection& inspection);

}  // namespace tandem
