#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/mesh.h>
#include <assimp/scene.h>
#include <assimp/version.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/limited_child.h"
#include "common/printable.h"
#include "input_file.h"
#include "mesh_assembly.h"
#include "mesh_message.h"
#include "readers.h"

namespace tandem::build {
namespace {

Affine local_transform(const aiNode& node) {
  const auto& m = node.mTransformation;
  return {{{m.a1, m.a2, m.a3, m.a4}, {m.b1, m.b2, m.b3, m.b4}, {m.c1, m.c2, m.c3, m.c4}}};
}

/// A node on the way through the tree. The way is kept in a list: trees of hostile files are deeper than a
/// stack.
struct Visit {
  const aiNode* node;
  Affine world;
  std::string path;
};

std::string_view text(const aiString& s) {
  return {s.C_Str(), s.length};
}

/// The FBX importer puts helper nodes between those of the file; they say nothing to its author.
std::string child_path(const std::string& parent, std::string_view name) {
  constexpr std::size_t kLongEnough = 2000;
  if (parent.size() > kLongEnough || name.find("$AssimpFbx$") != std::string_view::npos) return parent;
  return parent.empty() ? std::string(name) : parent + "/" + std::string(name);
}

void add_mesh(const aiMesh& mesh, const Visit& visit, MeshAssembly& out) {
  if (mesh.mVertices == nullptr || mesh.mFaces == nullptr) return;
  out.begin_part(text(mesh.mName), visit.path);
  const std::size_t first = out.point_count();
  for (const aiVector3D& v : std::span(mesh.mVertices, mesh.mNumVertices))
    out.add_point(transformed(visit.world, {v.x, v.y, v.z}));
  for (const aiFace& face : std::span(mesh.mFaces, mesh.mNumFaces)) {
    if (face.mNumIndices == 1) out.leave_out_points();
    if (face.mNumIndices == 2) out.leave_out_lines();
    if (face.mIndices == nullptr || face.mNumIndices < 3) continue;
    for (const unsigned index : std::span(face.mIndices, face.mNumIndices))
      out.add_corner(index < mesh.mNumVertices ? static_cast<std::int64_t>(first + index) : -1);
    out.end_face();
  }
}

/// The numbers of the meshes that a node shows.
std::span<const unsigned> meshes_of(const aiNode& node) {
  return {node.mMeshes, node.mMeshes == nullptr ? 0 : node.mNumMeshes};
}

std::span<aiNode* const> children_of(const aiNode& node) {
  return {node.mChildren, node.mChildren == nullptr ? 0 : node.mNumChildren};
}

/// The mesh of that number, or nullptr.
const aiMesh* mesh_of(const aiScene& scene, unsigned number) {
  return number < scene.mNumMeshes ? scene.mMeshes[number] : nullptr;
}

/// Vertices, faces and meshes that nodes show once more, after other nodes have shown them.
std::uint64_t repeated_elements(const aiScene& scene) {
  std::uint64_t repeated = 0;
  std::vector<bool> is_shown(scene.mNumMeshes);
  std::vector<const aiNode*> pending{scene.mRootNode};
  while (!pending.empty()) {
    const aiNode& node = *pending.back();
    pending.pop_back();
    for (const unsigned number : meshes_of(node)) {
      const aiMesh* mesh = mesh_of(scene, number);
      if (mesh == nullptr) continue;
      if (is_shown[number]) repeated += std::uint64_t{1} + mesh->mNumVertices + mesh->mNumFaces;
      is_shown[number] = true;
    }
    for (const aiNode* child : children_of(node))
      if (child != nullptr) pending.push_back(child);
  }
  return repeated;
}

ReadResult flatten(const aiScene& scene, const std::string& reader) {
  constexpr std::size_t kMostNameBytes = std::size_t{64} << 20;
  MeshAssembly out(reader, kMostNameBytes);
  const aiNode& root = *scene.mRootNode;
  std::vector<Visit> pending{{&root, local_transform(root), std::string(text(root.mName))}};
  while (!pending.empty()) {
    const Visit visit = std::move(pending.back());
    pending.pop_back();
    for (const unsigned number : meshes_of(*visit.node))
      if (const aiMesh* mesh = mesh_of(scene, number)) add_mesh(*mesh, visit, out);
    const std::span<aiNode* const> children = children_of(*visit.node);
    for (std::size_t i = children.size(); i-- > 0;)
      if (const aiNode* child = children[i])
        pending.push_back({child, combined(visit.world, local_transform(*child)),
                           child_path(visit.path, text(child->mName))});
  }
  ReadResult result = out.finish();
  result.mesh.single_precision = true;
  return result;
}

std::string version() {
  return "assimp " + std::to_string(aiGetVersionMajor()) + "." + std::to_string(aiGetVersionMinor()) + "." +
         std::to_string(aiGetVersionPatch());
}

/// assimp turns the exceptions of its importers into texts; a failed allocation is not its opinion on the
/// file.
ReadResult failure(const Assimp::Importer& importer) {
  if (importer.GetException()) {
    try {
      std::rethrow_exception(importer.GetException());
    } catch (const std::bad_alloc&) {
      throw;
    } catch (...) {
    }
  }
  constexpr std::size_t kMostErrorBytes = 500;
  const std::string error = printable(importer.GetErrorString(), kMostErrorBytes);
  return read_failure("assimp: " + (error.empty() ? "failed without a reason" : error));
}

/// Opens the files that assimp asks for where they are regular ones, since a named pipe would make it wait;
/// and, unless `limits` say otherwise, where they lie in the folder of the scene or below it.
class SceneFiles : public Assimp::DefaultIOSystem {
 public:
  SceneFiles(const std::filesystem::path& scene, const ReadLimits& limits)
      : scene_(scene), outside_files_(limits.outside_files) {}

  bool Exists(const char* name) const override { return may_open(name); }

  Assimp::IOStream* Open(const char* name, const char* mode) override {
    if (!may_open(name)) return nullptr;
    if (name != scene_.string()) files_.push_back(name);
    return DefaultIOSystem::Open(name, mode);
  }

  /// The files that were opened beside the scene.
  const std::vector<std::string>& files() const { return files_; }

  /// Returns whether a file was not opened because of where it lies.
  bool met_outside_file() const { return met_outside_file_; }

 private:
  bool may_open(const char* name) const {
    std::error_code none;
    if (!std::filesystem::is_regular_file(name, none)) return false;
    if (outside_files_ || name == scene_.string()) return true;
    if (why_not_beside(scene_.parent_path(), name).empty()) return true;
    met_outside_file_ = true;
    return false;
  }

  std::filesystem::path scene_;
  bool outside_files_;
  mutable bool met_outside_file_ = false;
  std::vector<std::string> files_;
};

/// Reads a mesh file with assimp, in this process: it may crash, hang, or take all memory.
ReadResult read_assimp_scene(const std::filesystem::path& path, const ReadLimits& limits) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  auto* const files = new SceneFiles(path, limits);  // which the importer will own
  importer.SetIOHandler(files);
  constexpr unsigned kNoPostProcessing = 0;  // faces stay polygons, in order; vertices stay apart
  const aiScene* scene = importer.ReadFile(path.string(), kNoPostProcessing);
  if (scene == nullptr) return failure(importer);
  if (scene->mRootNode == nullptr) return read_failure("assimp: the scene has no root node");
  const std::uint64_t repeated = repeated_elements(*scene);
  if (repeated > limits.expansion)
    return read_failure("instances of meshes repeat " + std::to_string(repeated) +
                        " vertices and faces, of " + std::to_string(limits.expansion) +
                        " that are allowed (--expansion-limit)");
  ReadResult result = flatten(*scene, version());
  result.files = files->files();
  if (files->met_outside_file())
    result.mesh.remarks.push_back(
        "names files outside its folder, which are not read (--allow-outside-files)");
  return result;
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string byte_size(std::uint64_t bytes) {
  constexpr std::uint64_t kGiB = std::uint64_t{1} << 30;
  if (bytes >= kGiB) return short_number(static_cast<double>(bytes) / static_cast<double>(kGiB)) + " GiB";
  return short_number(static_cast<double>(bytes) / (1 << 20)) + " MiB";
}

/// Address space that assimp may take for a file. Some formats let nodes repeat nodes, so that 2 kB of
/// COLLADA make 2^30 of them. OBJ and COLLADA files of 9 MB that repeat nothing need 16 to 18 times their
/// bytes.
std::uint64_t memory_for(const std::filesystem::path& path, const ReadLimits& limits) {
  constexpr std::uint64_t kBytesOfAnElement = 192;
  constexpr std::uint64_t kAlways = std::uint64_t{64} << 20;
  constexpr std::uint64_t kNoBound = UINT64_MAX / kBytesOfAnElement / 4;
  std::error_code no_size;
  const std::uint64_t bytes = std::min(std::filesystem::file_size(path, no_size), kNoBound);
  return std::min(limits.memory_bytes,
                  kAlways + kBytesOfAnElement * (bytes + std::min(limits.expansion, kNoBound)));
}

std::string crash(int signal) {
  if (signal == SIGKILL) return "assimp was killed (signal 9); perhaps the machine ran out of memory";
  return "assimp crashed (signal " + std::to_string(signal) + ")";
}

std::string explanation(ChildEnd end, int signal, std::uint64_t memory, const ImportOptions& options) {
  switch (end) {
    case ChildEnd::out_of_time:
      return "assimp did not finish within " + short_number(options.time_limit_seconds) + " s (--time-limit)";
    case ChildEnd::out_of_memory:
      return "assimp needed more than " + byte_size(memory) + " of memory (" +
             (memory < options.limits.memory_bytes ? "--expansion-limit)" : "--memory-limit)");
    case ChildEnd::crashed:
      return crash(signal);
    case ChildEnd::finished:
    case ChildEnd::lost:
      break;
  }
  return "assimp ended without a usable result";
}

}  // namespace

ReadResult read_in_assimp_child(const std::filesystem::path& path, const ImportOptions& options) {
  LimitedChild child;
  const std::uint64_t memory = memory_for(path, options.limits);
  const auto work = [&](const LimitedChild::Sink& sink) {
    write_message(read_assimp_scene(path, options.limits), sink);
  };
  const std::string no_child = child.start({options.time_limit_seconds, memory}, work);
  if (!no_child.empty()) return read_failure(no_child);
  ReadResult result;
  const auto source = [&child](void* to, std::size_t count) { return child.read(to, count); };
  if (read_message(source, memory, result)) return result;
  const ChildEnd end = child.finish();
  return read_failure(explanation(end, child.signal(), memory, options));
}

}  // namespace tandem::build
