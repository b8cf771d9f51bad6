#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "import.h"
#include "input_file.h"

namespace tandem::build {

using ReadBytes = ReadResult (*)(std::string_view);

/// Says who reads a file.
struct MeshKind {
  std::string refusal;         ///< why it is no mesh file; empty where it may be one
  ReadBytes reader = nullptr;  ///< our reader of OBJ, PLY, STL or OFF; null: it is none of these
  bool is_gltf = false;
};

/// Returns what the ending of a file's name and its first bytes say about it.
MeshKind kind_of(const std::filesystem::path& path, std::string_view head);

/// Effect: reads an open file. Result: empty, or why not.
std::string load(InputFile& file, const ReadLimits& limits);

/// Reads an open file with one of our readers.
ReadResult read_with(ReadBytes reader, InputFile& file, const ReadLimits& limits);

/// A mesh file of triangles and quads that takes no package to read.
struct PlainMesh {
  ReadResult read;
  TriangleMesh triangles;
  std::string needs_tools;  ///< why it takes packages after all; empty: it does not
};

/// Splits the quads of a mesh that was read, and says of one with larger faces which is the first of them.
PlainMesh plain_mesh_of(ReadResult read);

}  // namespace tandem::build
