#include "import.h"

#include <algorithm>
#include <exception>
#include <new>
#include <string_view>

#include "gltf_model.h"
#include "input_file.h"
#include "readers.h"

namespace tandem::build {
namespace {

using ReadBytes = ReadResult (*)(std::string_view);

/// The file's ending in lower case, with its dot.
std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
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

/// Effect: reads the file. Result: empty, or why not.
std::string load(InputFile& file, const ImportOptions& options) {
  if (file.size() <= options.limits.memory_bytes) return file.read_all();
  return "holds " + std::to_string(file.size()) + " bytes, more than the memory limit (--memory-limit)";
}

ReadResult read_with(ReadBytes reader, InputFile& file, const ImportOptions& options) {
  const std::string problem = load(file, options);
  return problem.empty() ? reader(file.bytes()) : read_failure(problem);
}

bool is_gltf(const std::string& extension, std::string_view head) {
  return extension == ".gltf" || extension == ".glb" || head.starts_with("glTF");
}

ReadResult read_gltf_file(const std::filesystem::path& path, InputFile& file, const ImportOptions& options) {
  const std::string problem = load(file, options);
  if (!problem.empty()) return read_failure(problem);
  ReadResult result = read_gltf(file.bytes(), path.parent_path(), options.limits);
  const bool may_ask_assimp = !result.ok && options.reader == Reader::automatic;
  return may_ask_assimp && is_for_another_gltf_reader(result.error) ? read_in_assimp_child(path, options)
                                                                    : result;
}

ReadResult read(const std::filesystem::path& path, const ImportOptions& options) {
  InputFile file;
  const std::string problem = file.open(path);
  if (!problem.empty()) return read_failure(problem);
  const std::string extension = lower_extension(path);
  const std::string head = file.head();
  const std::string no_mesh = refusal(extension, head);
  if (!no_mesh.empty()) return read_failure(no_mesh);
  const ReadBytes reader = own_reader(extension, head);
  if (options.reader == Reader::assimp) return read_in_assimp_child(path, options);
  if (reader != nullptr) return read_with(reader, file, options);
  if (is_gltf(extension, head)) return read_gltf_file(path, file, options);
  if (options.reader == Reader::automatic) return read_in_assimp_child(path, options);
  return read_failure("Tandem's own readers know OBJ, PLY, STL, OFF and glTF files only");
}

}  // namespace

ReadResult import_mesh(const std::filesystem::path& path, const ImportOptions& options) {
  try {
    return read(path, options);
  } catch (const std::bad_alloc&) {
    return read_failure("not enough memory to read it");
  } catch (const std::exception& error) {
    return read_failure(error.what());
  }
}

}  // namespace tandem::build
