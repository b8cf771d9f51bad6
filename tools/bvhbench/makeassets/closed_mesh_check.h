#pragma once

#include <string>

#include "mesh.h"

namespace tandem::makeassets {

// Empty when `mesh` is one closed, outward oriented 2-manifold of genus 0 with `triangles` triangles, none
// flat, and without self-intersection (decided exactly, on the coordinates as they are); else the first
// defect, in words.
[[nodiscard]] std::string closed_mesh_defect(const Mesh& mesh, std::size_t triangles);

}  // namespace tandem::makeassets
