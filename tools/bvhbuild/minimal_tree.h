#pragma once
#include "tree.h"

namespace tandem::build {

/// The tree of build_tree(geometry, Imaginary::minimal).
Tree build_minimal_tree(const Geometry& geometry);

}  // namespace tandem::build
