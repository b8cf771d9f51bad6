#include "own_readers.h"

#include <algorithm>

#include "common/path_text.h"
#include "readers.h"

namespace tandem::build {
namespace {

/// The file's ending in lower case, with its dot.
std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = text_of(path.extension());
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

std::string_view first_line(std::string_view head) {
  return head.substr(0, head.find_first_of("\r\n"));
}

/// Returns the reader of a file whose ending says nothing, or null.
ReadBytes reader_by_content(std::string_view head) {
  const std::string_view line = first_line(head);
  if (line == "ply") return read_ply;
  const std::string_view keyword = line.substr(0, line.find_first_of(" \t"));
  if (keyword == "OFF" || keyword == "COFF" || keyword == "NOFF" || keyword == "STOFF") return read_off;
  return nullptr;
}

ReadBytes own_reader(const std::string& extension, std::string_view head) {
  if (extension == ".obj") return read_obj;
  if (extension == ".ply") return read_ply;
  if (extension == ".stl") return read_stl;
  if (extension == ".off") return read_off;
  return reader_by_content(head);
}

/// Returns why a file that is something else than a mesh is refused; empty when it may be one.
std::string refusal(const std::string& extension, std::string_view head) {
  if (head.starts_with("\x89"
                       "BVH"))
    return "is already a Tandem tree, not a mesh";
  if (extension != ".bvh") return {};
  const std::size_t word = std::min(head.find_first_not_of(" \t\r\n"), head.size());
  if (head.substr(word).starts_with("HIERARCHY"))
    return "is Biovision motion capture (it starts with HIERARCHY), not a mesh";
  return "ends in .bvh but is neither a Tandem tree nor a mesh";
}

}  // namespace

MeshKind kind_of(const std::filesystem::path& path, std::string_view head) {
  const std::string extension = lower_extension(path);
  return {refusal(extension, head), own_reader(extension, head),
          extension == ".gltf" || extension == ".glb" || head.starts_with("glTF")};
}

std::string load(InputFile& file, const ReadLimits& limits) {
  if (file.size() <= limits.memory_bytes) return file.read_all();
  return "holds " + std::to_string(file.size()) + " bytes, more than the memory limit (--memory-limit)";
}

ReadResult read_with(ReadBytes reader, InputFile& file, const ReadLimits& limits) {
  const std::string problem = load(file, limits);
  return problem.empty() ? reader(file.bytes()) : read_failure(problem);
}

PlainMesh plain_mesh_of(ReadResult read) {
  PlainMesh mesh{std::move(read), {}, {}};
  if (!mesh.read.ok) return mesh;
  if (const auto face = first_face_beyond_quads(mesh.read.mesh)) {
    mesh.needs_tools = "face " + std::to_string(*face) + " has more than four corners";
    return mesh;
  }
  CleanReport report;
  mesh.triangles = triangulate(mesh.read.mesh, report, {});
  return mesh;
}

}  // namespace tandem::build
