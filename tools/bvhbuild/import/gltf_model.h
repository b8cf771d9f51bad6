#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gltf_json.h"
#include "input_file.h"
#include "mesh_assembly.h"

namespace tandem::build {

/// A buffer of a glTF file.
struct GltfBuffer {
  std::vector<char> decoded;              ///< the bytes of a data URI; empty for other buffers
  std::shared_ptr<const InputFile> file;  ///< the file that the bytes lie in; null for other buffers
  std::string_view bytes;                 ///< of `decoded`, of `file`, or of the container
};

/// Says where the bytes of buffers may lie.
struct GltfBufferPlaces {
  std::filesystem::path folder;         ///< that file names are relative to
  bool is_binary = false;               ///< whether this is a GLB file
  std::string_view chunk;               ///< its binary chunk
  std::uint64_t most_bytes_in_files{};  ///< that may still be read; each file that is read lowers it
  bool outside_files = false;           ///< whether files may lie elsewhere than in the folder or below it
  /// The files that buffers were found in. Each is read once, whatever names the buffers call it by.
  std::map<InputFile::Identity, std::shared_ptr<const InputFile>> files{};
  std::vector<std::string> paths{};  ///< of the files that were read
};

/// Replaces escapes: "a%20b.bin" becomes "a b.bin". Everything else stays as it is.
std::string percent_decoded(std::string_view text);

/// Decodes base64 up to the first character that is no digit of it, and at most `most_bytes` bytes.
std::vector<char> base64_decoded(std::string_view text, std::uint64_t most_bytes);

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
  int components = 0;      ///< 1 of a SCALAR, 3 of a VEC3, 16 of a MAT4
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

/// The parts of a node's transform that the file gives.
struct GltfParts {
  std::optional<std::array<double, 3>> translation, scale;
  std::optional<std::array<double, 4>> rotation;  ///< a quaternion x y z w, of any length but 0
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
  std::vector<std::string> files;    ///< that buffers lie in
};

/// Reads the parts of a node's transform. Throws a GltfError for lists of a wrong length and for a rotation
/// that is none.
GltfParts parts_of(const GltfObject& node);

/// The map that scales, then rotates, then translates. Parts that are left out stay out of the arithmetic.
Affine affine_of(const GltfParts& parts);

/// Reads the model out of a glTF file's JSON, and the buffers from where they are.
///
/// Throws a GltfError for another version than 2; for extensions that hide the triangles from us, by name;
/// for buffers that are missing or too short; for members of a wrong type; and for transforms that are not
/// affine.
GltfModel read_gltf_model(const GltfObject& root, GltfBufferPlaces places);

/// Returns whether assimp may read a file that was refused with this error: glTF 1, or Draco compression.
bool is_for_another_gltf_reader(std::string_view error);

}  // namespace tandem::build
