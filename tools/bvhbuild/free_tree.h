#pragma once
#include "tree.h"

namespace tandem::build {

/// The tree of build_tree(geometry, Imaginary::free).
Tree build_free_tree(const Geometry& geometry);

}  // namespace tandem::build
