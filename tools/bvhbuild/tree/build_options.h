#pragma once
#include "effort.h"
#include "tree.h"

namespace tandem::build {

/// What a .bvh file is to hold beside its triangles, and how long to look for a good tree.
struct BuildOptions {
  Imaginary imaginary = Imaginary::minimal;
  Effort effort = Effort::standard;
  bool gpu_blocks = true;  ///< the file gets oriented blocks
  bool topology = true;    ///< the file gets topology
};

}  // namespace tandem::build
