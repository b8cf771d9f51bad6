#pragma once

#include <filesystem>
#include <string>

#include "mesh.h"

namespace tandem::makeassets {

// Writes `mesh` whole or not at all (aside, then renamed): binary PLY with float32 coordinates when the name
// ends in .ply, else OBJ with at most six decimals. `comment` is one line of text for the header. Returns an
// empty string, or the reason of the failure.
[[nodiscard]] std::string write_mesh(const Mesh& mesh, const std::string& comment,
                                     const std::filesystem::path& path);

}  // namespace tandem::makeassets
