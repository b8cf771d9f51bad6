#include "import.h"

#include <exception>
#include <new>

#include "gltf_model.h"
#include "own_readers.h"
#include "readers.h"

namespace tandem::build {
namespace {

ReadResult read_gltf_file(const std::filesystem::path& path, InputFile& file, const ImportOptions& options) {
  const std::string problem = load(file, options.limits);
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
  const MeshKind kind = kind_of(path, file.head());
  if (!kind.refusal.empty()) return read_failure(kind.refusal);
  if (options.reader == Reader::assimp) return read_in_assimp_child(path, options);
  if (kind.reader != nullptr) return read_with(kind.reader, file, options.limits);
  if (kind.is_gltf) return read_gltf_file(path, file, options);
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
