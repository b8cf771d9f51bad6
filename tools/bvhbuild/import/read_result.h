#pragma once
#include <string>
#include <utility>

#include "bvhbuild/meshing/polygon_mesh.h"

namespace tandem::build {

/// What reading a mesh gives: the polygons, or the reason why there are none.
struct ReadResult {
  bool ok = false;
  PolygonMesh mesh;
  std::string error;  ///< when not ok: the reason without the file's name, "line 12: ...", "the reader
                      ///< crashed (signal 11)"
};

inline ReadResult read_failure(std::string reason) {
  return {false, {}, std::move(reason)};
}

}  // namespace tandem::build
