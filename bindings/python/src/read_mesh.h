#pragma once
#include <nanobind/nanobind.h>

#include <string>

#include "bindings/python/src/bytes.h"
#include "bvhbuild/import/import.h"
#include "bvhbuild/meshing/meshing.h"

/// The readers of both extensions use these to hand meshes to the package's Python files.
namespace tandem::python {

inline nanobind::bytes to_bytes(const std::string& text) {
  return nanobind::bytes(text.data(), text.size());
}

/// Points, corners of triangles, the face of each, parts, remarks.
inline nanobind::tuple rows_of(const build::PolygonMesh& mesh, const build::TriangleMesh& triangles) {
  nanobind::list parts, remarks;
  for (const build::SourcePart& part : mesh.parts)
    parts.append(nanobind::make_tuple(to_bytes(part.name), to_bytes(part.node_path), part.first_face,
                                      part.face_count));
  for (const std::string& remark : mesh.remarks) remarks.append(to_bytes(remark));
  const auto rows = [](const auto& all) { return to_python(all.data(), all.size()); };
  return nanobind::make_tuple(rows(triangles.points), rows(triangles.triangles), rows(triangles.face), parts,
                              remarks);
}

}  // namespace tandem::python
