#include "mesh_invariants.h"

#include <string_view>

#include "common/printable.h"

namespace tandem::build {
namespace {

std::string broken_faces(const PolygonMesh& mesh) {
  if (mesh.face_begin.empty() || mesh.face_begin.front() != 0) return "faces do not begin at corner 0";
  for (std::size_t f = 0; f < mesh.face_count(); ++f)
    if (mesh.face_begin[f + 1] < mesh.face_begin[f]) return "a face ends before it begins";
  if (mesh.face_begin.back() != mesh.corners.size()) return "corners are left over";
  return {};
}

std::string broken_parts(const PolygonMesh& mesh) {
  std::size_t next_face = 0;
  for (const SourcePart& part : mesh.parts) {
    if (part.first_face != next_face) return "parts have gaps";
    if (part.face_count == 0) return "a part has no faces";
    next_face += part.face_count;
  }
  return next_face == mesh.face_count() ? "" : "parts do not hold all faces";
}

bool is_clean(std::string_view text) {
  return printable(text, text.size()) == text;
}

std::string broken_text(const ReadResult& result) {
  constexpr std::size_t kMostRemarks = 8;
  if (!is_clean(result.error)) return "an error that JSON cannot carry";
  if (result.mesh.remarks.size() > kMostRemarks) return "too many remarks";
  for (const std::string& remark : result.mesh.remarks)
    if (!is_clean(remark)) return "a remark that JSON cannot carry";
  for (const SourcePart& part : result.mesh.parts)
    if (!is_clean(part.name) || !is_clean(part.node_path)) return "a name that JSON cannot carry";
  return {};
}

// The densest file: a triangle strip in bytes, where each index of one byte makes a triangle of 16.
std::string broken_memory(const PolygonMesh& mesh, std::size_t file_bytes) {
  constexpr std::size_t kMostPerByte = 40, kMostAtAll = 4096;
  std::size_t bytes = mesh.points.capacity() * sizeof(Point) +
                      mesh.corners.capacity() * sizeof(std::uint32_t) +
                      mesh.face_begin.capacity() * sizeof(std::uint32_t);
  for (const SourcePart& part : mesh.parts)
    bytes += sizeof(SourcePart) + part.name.size() + part.node_path.size();
  return bytes <= kMostAtAll + kMostPerByte * file_bytes ? "" : "memory is no small multiple of the file";
}

}  // namespace

std::string broken_invariant(const ReadResult& result, std::size_t file_bytes) {
  if (result.ok != result.error.empty()) return "a failure without a reason, or a success with one";
  std::string broken = broken_faces(result.mesh);
  if (broken.empty()) broken = broken_parts(result.mesh);
  if (broken.empty()) broken = broken_text(result);
  if (broken.empty()) broken = broken_memory(result.mesh, file_bytes);
  return broken;
}

}  // namespace tandem::build
