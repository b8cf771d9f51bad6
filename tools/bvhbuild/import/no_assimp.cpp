#include "readers.h"

namespace tandem::build {

ReadResult read_in_assimp_child(const std::filesystem::path&, const ImportOptions&) {
  return read_failure(
      "this program was built without assimp; its own readers know OBJ, PLY, STL, OFF and glTF");
}

}  // namespace tandem::build
