#pragma once
#include <string>
#include <vector>

#include "bvhbench/scenes/scene_file.h"
#include "tandem/kernels/motion.h"

namespace tandem::bench {

/// Returns how the instances of a scene move, as its file says: fixed ones stay where they are, and the
/// others turn about their centre of mass, where the file gives none. Throws FileError.
std::vector<RigidMotion> motions_of(const std::string& path, const LoadedScene& scene);

}  // namespace tandem::bench
