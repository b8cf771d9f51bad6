#pragma once
#include "gltf_model.h"
#include "read_limits.h"
#include "read_result.h"

namespace tandem::build {

/// Collects the triangles of a glTF scene, believing nothing the model says.
///
/// Result: the meshes of all nodes, depth first in the file's order, each instance by itself, with the node
/// transforms accumulated and applied in float64; a node that mirrors its mesh leaves the order of the
/// corners as it is. A part is one mesh at one node. Triangles, strips and fans become faces; points and
/// lines none. A strip's triangle that names a vertex twice only leads the strip elsewhere and is no face. An
/// index that names no vertex of its primitive becomes kNoVertex. Skins and morph targets are not applied.
/// Throws a GltfError for accessors that reach outside their buffers; nodes that are no tree; and, before any
/// memory is taken, for more vertices and corners, counting each instance, than `limits` or 2^32 - 2 allow.
ReadResult flatten_gltf(const GltfModel& model, const ReadLimits& limits);

}  // namespace tandem::build
