#include "read_mesh.h"

#include <exception>
#include <new>

#include "bvhbuild/import/own_readers.h"
#include "bvhbuild/import/readers.h"

using namespace tandem::build;

struct tandem_web_mesh {
  PlainMesh found;
  std::vector<tandem_mesh_part> parts;
  std::string remarks;
  tandem_mesh rows = {};
};

namespace {

// The first bytes of a file tell its kind.
constexpr std::size_t kHead = 64;

ReadResult read_polygons(const std::filesystem::path& name, std::string_view bytes) {
  if (bytes.empty()) return read_failure("the file is empty");
  const MeshKind kind = kind_of(name, bytes.substr(0, kHead));
  if (!kind.refusal.empty()) return read_failure(kind.refusal);
  if (kind.reader != nullptr) return kind.reader(bytes);
  if (kind.is_gltf) return read_gltf(bytes, {}, {});
  return read_failure("is no OBJ, PLY, STL, OFF or glTF file");
}

void fill_rows(tandem_web_mesh& mesh) {
  const PolygonMesh& polygons = mesh.found.read.mesh;
  const TriangleMesh& triangles = mesh.found.triangles;
  for (const SourcePart& part : polygons.parts)
    mesh.parts.push_back({part.name.c_str(), part.node_path.c_str(), part.face_count});
  for (const std::string& remark : polygons.remarks) mesh.remarks += remark + "\n";
  mesh.rows.struct_size = sizeof mesh.rows;
  mesh.rows.positions = triangles.points.data()->data();
  mesh.rows.vertex_count = triangles.points.size();
  mesh.rows.triangles = triangles.triangles.data()->data();
  mesh.rows.triangle_count = triangles.triangles.size();
  mesh.rows.faces = triangles.face.data();
  mesh.rows.parts = mesh.parts.data();
  mesh.rows.part_count = mesh.parts.size();
}

}  // namespace

tandem_web_mesh* tandem_web_read_mesh(const char* name, const char* bytes, size_t count) {
  auto* const mesh = new (std::nothrow) tandem_web_mesh;
  if (mesh == nullptr) return nullptr;
  try {
    mesh->found = plain_mesh_of(read_polygons(name, {bytes, count}));
    fill_rows(*mesh);
  } catch (const std::bad_alloc&) {
    mesh->found.read = read_failure("not enough memory to read it");
  } catch (const std::exception& error) {
    mesh->found.read = read_failure(error.what());
  }
  return mesh;
}

void tandem_web_mesh_destroy(tandem_web_mesh* mesh) {
  delete mesh;
}

const char* tandem_web_mesh_error(const tandem_web_mesh* mesh) {
  if (!mesh->found.needs_tools.empty()) return mesh->found.needs_tools.c_str();
  return mesh->found.read.ok ? nullptr : mesh->found.read.error.c_str();
}

const tandem_mesh* tandem_web_mesh_rows(const tandem_web_mesh* mesh) {
  return &mesh->rows;
}

const char* tandem_web_mesh_remarks(const tandem_web_mesh* mesh) {
  return mesh->remarks.c_str();
}
