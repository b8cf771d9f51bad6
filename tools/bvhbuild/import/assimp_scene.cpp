#include "assimp_scene.h"

#include <assimp/config.h>
#include <assimp/mesh.h>
#include <assimp/scene.h>
#include <assimp/version.h>

#include <assimp/Importer.hpp>
#include <exception>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "affine.h"
#include "common/printable.h"
#include "mesh_assembly.h"

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
    if (face.mIndices == nullptr || face.mNumIndices < 3) continue;  // points and lines
    for (const unsigned index : std::span(face.mIndices, face.mNumIndices))
      out.add_corner(index < mesh.mNumVertices ? static_cast<std::int64_t>(first + index) : -1);
    out.end_face();
  }
}

void add_meshes_of_node(const aiScene& scene, const Visit& visit, MeshAssembly& out) {
  if (visit.node->mMeshes == nullptr) return;
  for (const unsigned mesh : std::span(visit.node->mMeshes, visit.node->mNumMeshes))
    if (mesh < scene.mNumMeshes && scene.mMeshes[mesh] != nullptr) add_mesh(*scene.mMeshes[mesh], visit, out);
}

ReadResult flatten(const aiScene& scene, const std::string& reader) {
  constexpr std::size_t kMostNameBytes = std::size_t{64} << 20;
  MeshAssembly out(reader, kMostNameBytes);
  const aiNode& root = *scene.mRootNode;
  std::vector<Visit> pending{{&root, local_transform(root), std::string(text(root.mName))}};
  while (!pending.empty()) {
    const Visit visit = std::move(pending.back());
    pending.pop_back();
    add_meshes_of_node(scene, visit, out);
    const std::size_t children = visit.node->mChildren ? visit.node->mNumChildren : 0;
    for (std::size_t i = children; i-- > 0;)
      if (const aiNode* child = visit.node->mChildren[i])
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

}  // namespace

ReadResult read_assimp_scene(const std::filesystem::path& path) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  constexpr unsigned kNoPostProcessing = 0;  // faces stay polygons, in order; vertices stay apart
  const aiScene* scene = importer.ReadFile(path.string(), kNoPostProcessing);
  if (scene == nullptr) return failure(importer);
  if (scene->mRootNode == nullptr) return read_failure("assimp: the scene has no root node");
  return flatten(*scene, version());
}

}  // namespace tandem::build
