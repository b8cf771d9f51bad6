#pragma once
#include "tandem/build/effort.h"

namespace tandem::build {

/// How many imaginary nodes a tree may have.
struct Imaginary {
  /// Of all nodes, beyond the minimum. 0: the proven minimum, minimal_imaginary_nodes(). 1: wherever the
  /// cheapest collapse of a free binary tree puts them, about a fifth. Between: where a given number of them
  /// saves most.
  double share = 0;

  static const Imaginary minimal, free;
  bool operator==(const Imaginary&) const = default;
};

inline constexpr Imaginary Imaginary::minimal{0}, Imaginary::free{1};

/// What a .bvh file is to hold beside its triangles, and how long to look for a good tree, by how many
/// threads.
struct BuildOptions {
  Imaginary imaginary = Imaginary::minimal;
  Effort effort = Effort::standard;
  bool gpu_blocks = true;  ///< the file gets oriented blocks
  bool topology = true;    ///< the file gets topology
  unsigned threads = 0;    ///< that build, at most; 0: as many as the process may use
};

}  // namespace tandem::build
