#include "bindings/python/src/read_mesh.h"

#include <exception>
#include <new>

#include "bindings/python/src/core.h"
#include "bindings/python/src/without_lock.h"
#include "bvhbuild/import/own_readers.h"

namespace tandem::python {
namespace {

namespace nb = nanobind;

using build::PlainMesh;

PlainMesh read_plain(const std::string& path) {
  build::InputFile file;
  const std::string problem = file.open(path);
  if (!problem.empty()) return {build::read_failure(problem), {}, {}};
  const build::MeshKind kind = build::kind_of(path, file.head());
  if (!kind.refusal.empty()) return {build::read_failure(kind.refusal), {}, {}};
  if (kind.reader == nullptr) return {build::read_failure(""), {}, "it is no OBJ, PLY, STL or OFF file"};
  return build::plain_mesh_of(build::read_with(kind.reader, file, {}));
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
