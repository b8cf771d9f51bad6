#pragma once
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "affine.h"
#include "gltf_buffer.h"
#include "gltf_json.h"

namespace tandem::build {

/// Why a glTF file cannot be read. read_gltf() makes a ReadResult of it.
struct GltfError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The parts of a glTF file that say where its triangles are, as the file has them: no index, offset or count
/// in here is checked. An index of -1 stands for a member that the file leaves out.

struct GltfView {
  int buffer = -1;
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t stride = 0;  ///< 0: elements lie side by side
};

/// The sparse part of an accessor: new values for some of its elements.
struct GltfSparse {
  std::uint64_t count = 0;
  int index_view = -1;
  std::uint64_t index_offset = 0;
  int index_type = 0;
  int value_view = -1;
  std::uint64_t value_offset = 0;
};

struct GltfAccessor {
  int view = -1;  ///< -1: all elements are zero
  std::uint64_t offset = 0;
  std::uint64_t count = 0;
  int component_type = 0;  ///< glTF's number, see ComponentType
  int components = 0;      ///< 1 of a SCALAR, 3 of a VEC3
  bool normalized = false;
  std::optional<GltfSparse> sparse;
};

struct GltfPrimitive {
  int mode = 4;
  int positions = -1;  ///< accessor of POSITION
  int indices = -1;    ///< accessor; -1: the vertices in their order
  bool has_draco = false;
};

struct GltfMesh {
  std::string name;
  std::vector<GltfPrimitive> primitives;
  bool has_morph_weights = false;  ///< that differ from zero
};

struct GltfNode {
  std::string name;
  int mesh = -1;
  std::vector<int> children;
  Affine local = kIdentity;
  bool has_skin = false;
  bool has_morph_weights = false;  ///< that differ from zero
  bool is_instanced = false;       ///< by EXT_mesh_gpu_instancing
};

struct GltfModel {
  std::vector<GltfBuffer> buffers;
  std::vector<GltfView> views;
  std::vector<GltfAccessor> accessors;
  std::vector<GltfMesh> meshes;
  std::vector<GltfNode> nodes;
  std::vector<int> roots;            ///< nodes of the scene
  std::uint64_t bytes_held = 0;      ///< by the file and the files of its buffers, each counted once
  std::vector<std::string> remarks;  ///< for the report, at most a few
};

/// Names an item of a list for messages: "accessors[3]".
std::string numbered(const char* list, std::int64_t index);

/// Reads the model out of a glTF file's JSON, and the buffers from where they are.
///
/// Throws a GltfError for another version than 2; for extensions that hide the triangles from us, by name;
/// for buffers that are missing or too short; for members of a wrong type; and for transforms that are not
/// affine.
GltfModel read_gltf_model(const GltfObject& root, GltfBufferPlaces places);

/// Throws a GltfError for another version than 2.
void check_gltf_version(const std::string& version);

/// Whether assimp may be able to read a file that was refused with this error: glTF 1, or Draco compression.
bool is_for_another_gltf_reader(std::string_view error);

}  // namespace tandem::build
