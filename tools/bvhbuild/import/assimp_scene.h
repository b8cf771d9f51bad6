#pragma once
#include <filesystem>

#include "read_limits.h"
#include "read_result.h"

namespace tandem::build {

/// Reads a mesh file with assimp, in this process: it may crash, hang, or take all memory (see
/// assimp_child.h).
///
/// Result: the meshes of all nodes, depth first, each instance by itself, with the node transforms applied in
/// float64; polygons as the file has them; points and lines left out. A part is one mesh at one node. An
/// index that names no vertex of its mesh becomes kNoVertex. Instances that repeat more than
/// `limits.expansion` vertices and faces are refused before they are made.
ReadResult read_assimp_scene(const std::filesystem::path& path, const ReadLimits& limits);

}  // namespace tandem::build
