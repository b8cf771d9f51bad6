#include "sample_asset.h"

#include <numeric>
#include <random>

#include "bvhbuild/tree/topology.h"

namespace tandem::test {

void Mesh::add(std::array<float, 3> a, std::array<float, 3> b, std::array<float, 3> c) {
  const auto first = static_cast<std::uint32_t>(points.size());
  points.insert(points.end(), {a, b, c});
  triangles.push_back({first, first + 1, first + 2});
}

Mesh random_mesh(std::uint32_t triangles, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<float>(random() >> 40) * 0x1p-24f; };
  Mesh mesh;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const std::array<float, 3> a = {uniform(), uniform(), uniform()};
    const auto near = [&] {
      return std::array<float, 3>{a[0] + 0.1f * uniform(), a[1] + 0.1f * uniform(), a[2] + 0.1f * uniform()};
    };
    const auto b = near();
    mesh.add(a, b, near());
  }
  return mesh;
}

build::Image make_file(const Mesh& mesh, build::Imaginary imaginary, build::Effort effort) {
  return make_file(mesh, build::build_tree(mesh.geometry(), imaginary, effort), effort);
}

build::Image assembled(std::span<const build::AssetLevel> levels, std::size_t faces,
                       std::span<const build::SourcePart> parts, std::size_t vertices) {
  build::AssetSource source;
  source.source_faces = faces;
  source.source_vertices = vertices;
  source.parts = parts;
  source.provenance = "{\"tool\":\"test\"}";
  return build::assemble(source, levels);
}

static std::vector<std::uint32_t> numbers(std::size_t count) {
  std::vector<std::uint32_t> out(count);
  std::iota(out.begin(), out.end(), 0u);
  return out;
}

static build::Image make_file(const Mesh& mesh, const build::Tree& tree, build::Effort effort,
                              std::span<const std::uint32_t> source_vertex) {
  const std::size_t n = mesh.triangles.size();
  const std::vector<std::uint32_t> face = numbers(n);
  const build::SourcePart parts[] = {{"left", "scene/left", 0, n / 2}, {"right", "", n / 2, n - n / 2}};
  const auto oriented_blocks = build::orient_blocks(mesh.geometry(), tree, effort);
  const build::SurfaceTopology topology = build::make_topology(mesh.geometry(), tree);
  const build::AssetLevel level{mesh.geometry(), face, &tree, oriented_blocks, 0, &topology, source_vertex};
  return assembled({&level, 1}, n, parts, source_vertex.size());
}

build::Image make_file(const Mesh& mesh, const build::Tree& tree, build::Effort effort) {
  return make_file(mesh, tree, effort, {});
}

build::Image make_refittable_file(const Mesh& mesh) {
  return make_file(mesh, build::build_tree(mesh.geometry()), build::Effort::standard,
                   numbers(mesh.points.size()));
}

build::Image make_file_of_levels(std::span<const Mesh> meshes) {
  const std::size_t faces = meshes[0].triangles.size();
  const std::vector<std::uint32_t> face = numbers(faces), vertex = numbers(meshes[0].points.size());
  struct Built {
    build::Tree tree;
    std::vector<OrientedBlock> oriented_blocks;
    build::SurfaceTopology topology;
  };
  std::vector<Built> built;
  for (const Mesh& mesh : meshes) {
    build::Tree tree = build::build_tree(mesh.geometry());
    auto oriented_blocks = build::orient_blocks(mesh.geometry(), tree, build::Effort::standard);
    auto topology = build::make_topology(mesh.geometry(), tree);
    built.push_back({std::move(tree), std::move(oriented_blocks), std::move(topology)});
  }
  std::vector<build::AssetLevel> levels;
  for (std::size_t i = 0; i < meshes.size(); ++i)
    levels.push_back({meshes[i].geometry(), face, &built[i].tree, built[i].oriented_blocks,
                      static_cast<double>(i), &built[i].topology,
                      std::span(vertex).first(meshes[i].points.size())});
  const build::SourcePart part = {"all", "", 0, faces};
  return assembled(levels, faces, {&part, 1}, vertex.size());
}

std::vector<Mesh> random_levels(std::uint32_t triangles, std::uint32_t levels, std::uint64_t seed) {
  std::vector<Mesh> meshes = {random_mesh(triangles, seed)};
  while (meshes.size() < levels) {
    meshes.push_back(meshes.back());
    meshes.back().triangles.resize((meshes.back().triangles.size() + 1) / 2);
  }
  return meshes;
}

build::Tree deepest_tree(const Mesh& mesh) {
  build::Topology topology;
  std::uint32_t triangle = 0;
  const auto leaf_block = [&] {
    build::TopologyBlock block = {{}, kNodesPerBlock, true};
    for (std::uint32_t& child : block.child) child = triangle++;
    topology.push_back(block);
    return static_cast<std::uint32_t>(topology.size() - 1);
  };
  for (std::uint32_t level = 1; level < kMaxDepth; ++level) {
    const std::size_t self = topology.size();
    topology.push_back({{}, kNodesPerBlock, false});
    for (int i = 1; i < kNodesPerBlock; ++i) {
      const std::uint32_t child = leaf_block();
      topology[self].child[i] = child;
    }
    topology[self].child[0] = static_cast<std::uint32_t>(topology.size());  // the next level's, or the last
  }
  leaf_block();
  return build::emit(mesh.geometry(), topology);
}

Section& Bytes::section(SectionKind kind) {
  std::size_t i = 0;
  while (section(i).kind != kind) ++i;
  return section(i);
}

}  // namespace tandem::test
