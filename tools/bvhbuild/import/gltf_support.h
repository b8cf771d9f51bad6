#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "import/gltf_json.h"

namespace tandem::build {

/// What of glTF is read, and by whom.

/// Result: empty for glTF 2, else why a file of this version is not read.
std::string check_gltf_version(const std::string& version);

/// Result: empty, or the required extension that hides the triangles from us.
std::string check_required_extensions(const GltfJson& json);

/// What to say of required extensions that are not known, at most two remarks.
std::vector<std::string> remarks_on_extensions(const GltfJson& json);

/// Whether Draco's data may be in a file, required or beside plain data.
bool uses_draco(const GltfJson& json);

/// The error of a file whose triangles only Draco's data holds.
std::string needs_draco();

/// Whether an error is one that assimp may not have: glTF 1, or Draco.
bool is_for_another_gltf_reader(std::string_view error);

}  // namespace tandem::build
