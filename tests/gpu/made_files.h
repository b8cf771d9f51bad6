#pragma once
#include <numeric>
#include <span>
#include <vector>

#include "build/sample_asset.h"

/// Files that bvhbuild makes by options, or not at all.
namespace tandem::test {

/// A tree of any shape as a level of a file.
struct MadeLevel {
  Mesh mesh;
  build::Tree tree;
  double error_bound = 0;
};

inline MadeLevel built_level(const Mesh& mesh, double error_bound = 0) {
  return {mesh, build::build_tree(mesh.geometry()), error_bound};
}

/// A file of these levels, all of whose faces are in one part. Source face i is triangle i of its mesh.
inline build::Image made_image(std::span<const MadeLevel> levels, bool oriented = true,
                               bool with_topology = true) {
  std::vector<std::vector<OrientedBlock>> blocks(levels.size());
  std::vector<std::vector<std::uint32_t>> faces(levels.size());
  std::vector<build::SurfaceTopology> topology(levels.size());
  std::vector<std::vector<std::uint32_t>> vertices(levels.size());
  std::vector<build::AssetLevel> rows;
  build::AssetSource source;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const auto& [mesh, tree, error_bound] = levels[i];
    faces[i].resize(mesh.triangles.size());
    std::iota(faces[i].begin(), faces[i].end(), 0u);
    source.source_faces = std::max<std::uint64_t>(source.source_faces, faces[i].size());
    if (oriented) blocks[i] = build::orient_blocks(mesh.geometry(), tree, build::Effort::fast);
    rows.push_back({mesh.geometry(), faces[i], &tree, blocks[i], error_bound});
    if (!with_topology) continue;
    topology[i] = build::make_topology(mesh.geometry(), tree);
    rows.back().topology = &topology[i];
    vertices[i].resize(mesh.points.size());
    std::iota(vertices[i].begin(), vertices[i].end(), 0u);
    rows.back().source_vertex = vertices[i];
    source.source_vertices = std::max<std::uint64_t>(source.source_vertices, vertices[i].size());
  }
  const build::SourcePart part = {"all", "", 0, source.source_faces};
  source.parts = {&part, 1};
  source.provenance = "{}";
  return build::assemble(source, rows);
}

inline Bytes made_file(std::span<const MadeLevel> levels, bool oriented = true, bool with_topology = true) {
  return Bytes(made_image(levels, oriented, with_topology));
}

/// A tree as deep as asked for: of the four children of an internal block three are leaf blocks.
inline MadeLevel deep_level(const Mesh& mesh, std::uint32_t depth) {
  MadeLevel level = {mesh, {}, 0};
  build::Tree& tree = level.tree;
  const auto add_leaf_block = [&] {
    Block block;
    for (int i = 0; i < kNodesPerBlock; ++i) {
      const auto t = static_cast<std::uint32_t>(tree.order.size());
      Position lo, hi;
      for (std::size_t k = 0; k < 3; ++k) {
        lo[k] = HUGE_VALF, hi[k] = -HUGE_VALF;
        for (const std::uint32_t vertex : mesh.triangles[t]) {
          lo[k] = std::min(lo[k], mesh.points[vertex][k]);
          hi[k] = std::max(hi[k], mesh.points[vertex][k]);
        }
      }
      set_node(block, i, enclose(lo, hi), t, NodeKind::leaf);
      tree.order.push_back(t);
    }
    tree.blocks.push_back(block);
    ++tree.leaf_block_count;
  };
  for (std::uint32_t above = 1; above < depth; ++above) {
    tree.blocks.emplace_back();  // filled in below, as its children's boxes must be there
    for (int i = 0; i < 3; ++i) add_leaf_block();
  }
  add_leaf_block();
  tree.depth = depth;
  for (std::uint32_t at = 4 * (depth - 1); at >= 4; at -= 4) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t child = at - 3 + i;
      set_node(tree.blocks[at - 4], static_cast<int>(i), enclose(tree.blocks[child]), child,
               NodeKind::internal);
    }
  }
  return level;
}

/// How many triangles that takes.
constexpr std::uint32_t triangles_of_deep_level(std::uint32_t depth) {
  return 12 * (depth - 1) + 4;
}

}  // namespace tandem::test
