#pragma once

#include <functional>

#include "mesh.h"

namespace tandem::makeassets {

struct Bounds {
  Point lower, upper;
};

// The zero surface of `distance` (negative inside) by marching tetrahedra over cubes of side `cell`. The
// result is a closed 2-manifold, oriented outwards, provided that the surface stays inside `bounds`.
[[nodiscard]] Mesh polygonise(const std::function<double(const Point&)>& distance, const Bounds& bounds,
                              double cell);

}  // namespace tandem::makeassets
