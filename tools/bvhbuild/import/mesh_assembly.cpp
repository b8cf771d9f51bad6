#include "mesh_assembly.h"

#include <utility>

#include "common/printable.h"

namespace tandem::build {

MeshAssembly::MeshAssembly(std::string reader, std::size_t file_bytes) : name_bytes_left_(file_bytes) {
  mesh_.reader = std::move(reader);
  mesh_.parts.emplace_back();
}

void MeshAssembly::reserve_faces(std::size_t faces, std::size_t corners) {
  mesh_.face_begin.reserve(mesh_.face_begin.size() + faces);
  mesh_.corners.reserve(mesh_.corners.size() + corners);
}

void MeshAssembly::begin_part(std::string_view name, std::string_view node_path) {
  constexpr std::size_t kMostNameBytes = 1000;
  SourcePart part{printable(name, kMostNameBytes), printable(node_path, kMostNameBytes), 0, 0};
  const std::size_t name_bytes = part.name.size() + part.node_path.size();
  if (name_bytes > name_bytes_left_) {
    part = {};
    names_left_out_ = true;
  } else {
    name_bytes_left_ -= name_bytes;
  }
  close_part();
  const bool goes_on = !mesh_.parts.empty() && mesh_.parts.back().name == part.name &&
                       mesh_.parts.back().node_path == part.node_path;
  if (goes_on) return;
  part.first_face = face_count();
  mesh_.parts.push_back(std::move(part));
}

void MeshAssembly::close_part() {
  if (mesh_.parts.empty()) return;
  SourcePart& last = mesh_.parts.back();
  last.face_count = face_count() - last.first_face;
  if (last.face_count == 0) mesh_.parts.pop_back();
}

void MeshAssembly::remark_index(std::string_view place, std::int64_t index, std::size_t vertices) {
  remark_index(std::string(place) + " " + std::to_string(index) + " of " + std::to_string(vertices) +
               " vertices");
}

void MeshAssembly::remark_index(std::string text) {
  ++index_remarks_;
  remark(std::move(text));
}

ReadResult MeshAssembly::finish() {
  if (mesh_.points.size() > kNoVertex) return read_failure("more than 4294967295 vertices");
  if (mesh_.corners.size() > UINT32_MAX) return read_failure("more than 4294967295 corners of faces");
  close_part();
  if (names_left_out_) remark("the names of parts are longer than the file; some were left out");
  return {true, std::move(mesh_), {}};
}

}  // namespace tandem::build
