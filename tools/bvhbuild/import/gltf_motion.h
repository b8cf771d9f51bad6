#pragma once
#include <string>
#include <vector>

#include "gltf_model.h"

namespace tandem::build {

/// The parts of a glTF file that say how its meshes move, as the file has them: no index or count in here is
/// checked. An index of -1 stands for a member that the file leaves out.

struct GltfNodeMotion {
  GltfParts parts;
  bool has_matrix = false;
  int skin = -1;
  std::vector<double> weights;  ///< of the morph targets of its mesh; empty: those of the mesh
};

struct GltfSkin {
  std::vector<int> joints;  ///< nodes
  int inverse_bind = -1;    ///< accessor
};

struct GltfPrimitiveMotion {
  std::vector<int> targets;          ///< accessors of POSITION, -1 where a target moves nothing
  std::vector<int> joints, weights;  ///< accessors of JOINTS_0, JOINTS_1, ..., WEIGHTS_0, ...
};

struct GltfMeshMotion {
  std::vector<GltfPrimitiveMotion> primitives;
  std::vector<double> weights;  ///< of its morph targets; empty: all are 0
};

struct GltfSampler {
  int input = -1, output = -1;  ///< accessors
  std::string interpolation;    ///< empty: LINEAR
};

struct GltfChannel {
  int sampler = -1, node = -1;
  std::string path;
};

struct GltfAnimation {
  std::string name;
  std::vector<GltfSampler> samplers;
  std::vector<GltfChannel> channels;
};

struct GltfMotion {
  std::vector<GltfNodeMotion> nodes;
  std::vector<GltfMeshMotion> meshes;
  std::vector<GltfSkin> skins;
  std::vector<GltfAnimation> animations;
};

/// Reads them out of a glTF file's JSON. Throws a GltfError for members of a wrong type.
GltfMotion read_gltf_motion(const GltfObject& root);

}  // namespace tandem::build
