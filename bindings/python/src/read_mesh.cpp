#include "bindings/python/src/read_mesh.h"

#include <exception>
#include <new>

#include "bindings/python/src/core.h"
#include "bindings/python/src/without_lock.h"
#include "bvhbuild/import/own_readers.h"

namespace tandem::python {
namespace {

namespace nb = nanobind;

// A mesh file of triangles and quads that takes no package to read.
struct PlainMesh {
  build::ReadResult read;
  build::TriangleMesh triangles;
  std::string needs_tools;  // why the mesh tools are needed; empty: they are not
};

PlainMesh read_plain(const std::string& path) {
  PlainMesh found;
  build::InputFile file;
  const std::string problem = file.open(path);
  if (!problem.empty()) return {build::read_failure(problem), {}, {}};
  const build::MeshKind kind = build::kind_of(path, file.head());
  if (!kind.refusal.empty()) return {build::read_failure(kind.refusal), {}, {}};
  if (kind.reader == nullptr) return {build::read_failure(""), {}, "it is no OBJ, PLY, STL or OFF file"};
  found.read = build::read_with(kind.reader, file, {});
  if (!found.read.ok) return found;
  if (const auto face = build::first_face_beyond_quads(found.read.mesh)) {
    found.needs_tools = "face " + std::to_string(*face) + " has more than four corners";
    return found;
  }
  build::CleanReport report;
  found.triangles = build::triangulate(found.read.mesh, report, {});
  return found;
}

// Rows as of rows_of(), or none and why, and whether the mesh tools could read it.
nb::tuple read(const nb::bytes& path) {
  const std::string name = path.c_str();
  PlainMesh found;
  {
    const WithoutLock other_threads_run;
    try {
      found = read_plain(name);
    } catch (const std::bad_alloc&) {
      found.read = build::read_failure("not enough memory to read it");
    } catch (const std::exception& error) {
      found.read = build::read_failure(error.what());
    }
  }
  if (!found.needs_tools.empty()) return nb::make_tuple(nb::none(), to_bytes(found.needs_tools), true);
  if (!found.read.ok) return nb::make_tuple(nb::none(), to_bytes(found.read.error), false);
  return rows_of(found.read.mesh, found.triangles);
}

}  // namespace

void add_readers(nb::module_& module) {
  module.def("read", read);
}

}  // namespace tandem::python
