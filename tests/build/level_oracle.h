#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "tandem/formats/view.h"

/// Finds out in another way whether a level is as the checker promises. For topology it uses maps of
/// positions and edges, and walks from triangle to triangle. For oriented blocks it takes rotations from
/// quaternions as textbooks write them, numbers the blocks with a queue, and computes boxes in long double.
namespace tandem::test {
namespace topology_oracle_detail {

/// The sides of each edge, 3 t + k, by its lower and upper vertex.
using Edges = std::map<std::array<std::uint32_t, 2>, std::vector<std::uint32_t>>;

inline Edges edges_of(const LevelView& level) {
  Edges edges;
  for (std::uint32_t side = 0; side < 3 * level.triangle_count; ++side) {
    const auto& vertex = level.topology[side / 3].vertex;
    const std::uint32_t u = vertex[side % 3], v = vertex[(side + 1) % 3];
    if (u != v) edges[{std::min(u, v), std::max(u, v)}].push_back(side);
  }
  return edges;
}

inline bool runs_up(const LevelView& level, std::uint32_t side) {
  const auto& vertex = level.topology[side / 3].vertex;
  return vertex[side % 3] < vertex[(side + 1) % 3];
}

inline bool is_turned(const LevelView& level, std::uint32_t triangle) {
  return (level.topology[triangle].flags & 1) != 0;
}

/// Numbers what may(edge's sides) joins, in the order of its first triangle.
template <typename May>
std::vector<std::uint32_t> groups(const LevelView& level, const Edges& edges, const May& may) {
  std::vector<std::vector<std::uint32_t>> beside(level.triangle_count);
  for (const auto& [ends, sides] : edges) {
    if (!may(sides)) continue;
    for (const std::uint32_t side : sides) {
      beside[sides[0] / 3].push_back(side / 3);
      beside[side / 3].push_back(sides[0] / 3);
    }
  }
  std::vector<std::uint32_t> group(level.triangle_count, kNoIndex);
  std::uint32_t next = 0;
  for (std::uint32_t seed = 0; seed < level.triangle_count; ++seed) {
    if (group[seed] != kNoIndex) continue;
    std::vector<std::uint32_t> pending = {seed};
    group[seed] = next;
    while (!pending.empty()) {
      const std::uint32_t t = pending.back();
      pending.pop_back();
      for (const std::uint32_t other : beside[t]) {
        if (group[other] == kNoIndex) group[other] = next, pending.push_back(other);
      }
    }
    ++next;
  }
  return group;
}

inline const char* defect_of_vertices(const LevelView& level) {
  std::map<std::array<float, 4>, std::uint32_t> at;
  std::set<std::uint32_t> sources;
  if (level.source_vertices != nullptr)
    sources.insert(level.source_vertices, level.source_vertices + level.vertex_count);
  const bool apart = level.source_vertices != nullptr;  // vertices at one position may differ
  if (apart && sources.size() != level.vertex_count) return "no two vertices have one source vertex";
  for (std::uint32_t side = 0; side < 3 * level.triangle_count; ++side) {
    const float* p = level.triangles[side / 3].corner[side % 3].position;
    const auto number = static_cast<std::uint32_t>(at.size());
    const std::uint32_t vertex = level.topology[side / 3].vertex[side % 3];
    if (at.try_emplace({p[0], p[1], p[2], apart ? static_cast<float>(vertex) : 0}, number).first->second !=
        vertex)
      return "vertices are the positions, numbered as they appear";
  }
  return at.size() == level.vertex_count ? nullptr : "the level says how many vertices there are";
}

inline const char* defect_of_edges(const LevelView& level, const Edges& edges) {
  std::vector<std::uint32_t> flags(level.triangle_count);
  for (const auto& [ends, sides] : edges) {
    for (const std::uint32_t side : sides) {
      if (sides.size() == 1) flags[side / 3] |= 2u << side % 3;
      if (sides.size() > 2) flags[side / 3] |= 16u << side % 3;
    }
  }
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    if ((level.topology[t].flags & ~1u) != flags[t]) return "flags count the sides of edges";
  }
  return nullptr;
}

inline const char* defect_of_components(const LevelView& level, const Edges& edges) {
  const auto component = groups(level, edges, [](const auto&) { return true; });
  std::vector<SurfaceComponent> components;
  std::vector<std::uint32_t> turned;
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    if (component[t] == components.size()) {
      components.push_back({t, 0, 1, 0});
      turned.push_back(0);
    }
    ++components[component[t]].triangle_count;
    turned[component[t]] += is_turned(level, t);
  }
  for (const auto& [ends, sides] : edges) {
    int sum = 0;
    for (const std::uint32_t side : sides) sum += runs_up(level, side) != is_turned(level, side / 3) ? 1 : -1;
    if (sum != 0) components[component[sides[0] / 3]].flags = 0;
  }
  if (level.component_count != components.size()) return "there are as many components as said";
  bool closed = true;
  for (std::size_t c = 0; c < components.size(); ++c) {
    const SurfaceComponent &said = level.components[c], &is = components[c];
    if (said.first_triangle != is.first_triangle || said.triangle_count != is.triangle_count ||
        said.flags != is.flags || said.reserved != 0)
      return "components are what edges join, closed where said to be";
    if (is.flags == 0 && 2 * turned[c] > is.triangle_count) return "the larger part keeps its winding";
    closed = closed && is.flags == 1;
  }
  return closed == level.closed ? nullptr : "a level is closed where all components are";
}

/// Windings in a patch, which edges of two sides join: by walking from triangle to triangle.
inline const char* defect_of_windings(const LevelView& level, const Edges& edges) {
  const auto patch = groups(level, edges, [](const auto& sides) { return sides.size() == 2; });
  const std::size_t n = level.triangle_count;
  std::vector<int> color(n, -1);
  std::vector<bool> orientable(n, true), agrees(n, true);
  for (std::uint32_t seed = 0; seed < n; ++seed) {
    if (color[seed] < 0) color[seed] = 0;
    for (bool changes = true; changes;) {
      changes = false;
      for (const auto& [ends, sides] : edges) {
        if (sides.size() != 2 || patch[sides[0] / 3] != patch[seed]) continue;
        const bool differ = runs_up(level, sides[0]) == runs_up(level, sides[1]);
        for (const int i : {0, 1}) {
          const std::uint32_t s = sides[i] / 3, t = sides[1 - i] / 3;
          if (color[s] < 0) continue;
          const int wanted = color[s] ^ static_cast<int>(differ);
          if (color[t] < 0) color[t] = wanted, changes = true;
          if (color[t] != wanted) orientable[patch[s]] = false;
        }
        if ((is_turned(level, sides[0] / 3) != is_turned(level, sides[1] / 3)) != differ)
          agrees[patch[seed]] = false;
      }
    }
    if (orientable[patch[seed]] && !agrees[patch[seed]]) return "windings agree where they can";
  }
  return nullptr;
}

}  // namespace topology_oracle_detail

/// Says what is wrong with the topology of a level whose triangles are sound, or null. It is slow: use small
/// meshes.
inline const char* defect_of_topology(const LevelView& level) {
  using namespace topology_oracle_detail;
  if (const char* defect = defect_of_vertices(level)) return defect;
  const Edges edges = edges_of(level);
  if (const char* defect = defect_of_edges(level, edges)) return defect;
  if (const char* defect = defect_of_components(level, edges)) return defect;
  return defect_of_windings(level, edges);
}

namespace oriented_oracle_detail {

using Real = long double;

struct Rotation {
  std::int64_t matrix[3][3];  ///< times length
  std::int64_t length;        ///< of the quaternion, squared
  bool legal;
};

inline Rotation rotation_of(const OrientedBlock& block) {
  const std::uint32_t half[4] = {block.rotation.wx & 0xFFFFu, block.rotation.wx >> 16,
                                 block.rotation.yz & 0xFFFFu, block.rotation.yz >> 16};
  Rotation out = {{}, 0, true};
  std::int64_t q[4];
  for (int i = 0; i < 4; ++i) {
    q[i] = std::int64_t{half[i]} - 2048;
    out.legal = out.legal && half[i] > 0 && half[i] < 4096;
    out.length += q[i] * q[i];
  }
  out.legal = out.legal && out.length > 0;
  // w^2 - |u|^2, 2 u u^T and 2 w times the matrix of u x.
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const std::int64_t cross = i == k ? 0 : (i + 1) % 3 == k ? -q[4 - i - k] : q[4 - i - k];
      out.matrix[i][k] =
          (i == k ? 2 * q[0] * q[0] - out.length : 0) + 2 * q[i + 1] * q[k + 1] + 2 * q[0] * cross;
    }
  }
  return out;
}

/// Whether node `node` holds the triangles from `first` to `end`. The terms are exact; two sums of three
/// numbers lose 2^-62 of the largest at most, a thousandth of what the checker keeps as its margin, and
/// nothing where the frame is the mesh's.
inline bool holds(const LevelView& level, const OrientedBlock& block, int node, std::uint32_t first,
                  std::uint32_t end) {
  const Rotation rotation = rotation_of(block);
  for (std::uint32_t t = first; t < end; ++t) {
    for (const Triangle::Corner& corner : level.triangles[t].corner) {
      for (int k = 0; k < 3; ++k) {
        Real at = 0;
        for (int i = 0; i < 3; ++i)
          at += static_cast<Real>(rotation.matrix[i][k]) * static_cast<Real>(corner.position[i]);
        const Real n = static_cast<Real>(rotation.length), c = n * static_cast<Real>(block.centre[k][node]),
                   h = n * static_cast<Real>(block.half_extent[k][node]);
        if (!(at >= c - h && at <= c + h)) return false;
      }
    }
  }
  return true;
}

inline bool is_finite_box(const OrientedBlock& block, int node) {
  bool finite = true;
  for (int k = 0; k < 3; ++k) {
    finite = finite && std::isfinite(block.centre[k][node]) && std::isfinite(block.half_extent[k][node]) &&
             block.half_extent[k][node] >= 0;
  }
  return finite;
}

inline bool is_empty_box(const OrientedBlock& block, int node) {
  bool empty = true;
  for (int k = 0; k < 3; ++k) {
    empty = empty && block.centre[k][node] == 0 && !std::signbit(block.centre[k][node]) &&
            block.half_extent[k][node] == kImaginaryHalfExtent;
  }
  return empty;
}

/// The edge of the cube with the surface of the largest box.
inline bool has_right_size(const OrientedBlock& block) {
  Real largest = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if (!is_finite_box(block, i)) continue;
    const Real x = block.half_extent[0][i], y = block.half_extent[1][i], z = block.half_extent[2][i];
    largest = std::fmax(largest, x * y + y * z + z * x);
  }
  const Real size = std::sqrt(largest / 3);
  return std::fabs(size - static_cast<Real>(block.size)) <= 0x1p-23L * size + 0x1p-149L;
}

}  // namespace oriented_oracle_detail

/// Says what is wrong with the oriented blocks of a level whose blocks are sound, or null.
inline const char* defect_of_oriented_blocks(const LevelView& level) {
  using namespace oriented_oracle_detail;
  // Triangles below each block. Children come after their parents.
  std::vector<std::uint32_t> first(level.block_count), end(level.block_count);
  for (std::uint32_t b = level.block_count; b-- > 0;) {
    const Block& block = level.blocks[b];
    first[b] = block.is_leaf_block() ? block.index[0] : first[block.index[0]];
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (block.kind[i] == NodeKind::leaf) end[b] = block.index[i] + 1;
      if (block.kind[i] == NodeKind::internal) end[b] = end[block.index[i]];
    }
  }
  std::vector<std::uint32_t> number(level.block_count);
  std::uint32_t next = 1;
  for (std::uint32_t b = 0; b < level.block_count; ++b) {
    const Block& block = level.blocks[b];
    const OrientedBlock& oriented = level.oriented_blocks[number[b]];
    if (oriented.is_leaf_block() != block.is_leaf_block()) return "leaf blocks are leaf blocks";
    if ((oriented.first_below & ~OrientedBlock::kIsLeafBlock) != (block.is_leaf_block() ? first[b] : next))
      return "what is below is named in the order of the blocks";
    if (!rotation_of(oriented).legal) return "rotations are quaternions of small whole numbers";
    if (!has_right_size(oriented)) return "the size is that of the largest box";
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (block.kind[i] == NodeKind::imaginary) {
        if (!is_empty_box(oriented, i)) return "oriented boxes of imaginary nodes are empty";
        continue;
      }
      const std::uint32_t below = block.index[i];
      const bool leaf = block.kind[i] == NodeKind::leaf;
      if (!leaf) number[below] = next++;
      if (!is_finite_box(oriented, i)) return "oriented boxes are finite";
      if (!holds(level, oriented, i, leaf ? below : first[below], leaf ? below + 1 : end[below]))
        return "oriented boxes hold the triangles below them";
    }
  }
  return next == level.block_count ? nullptr : "there are as many oriented blocks as blocks";
}

/// Says what is wrong with a level that has oriented blocks and topology, or null.
inline const char* defect_of(const LevelView& level) {
  if (level.oriented_blocks == nullptr || level.topology == nullptr) return "a level has both";
  const char* defect = defect_of_oriented_blocks(level);
  return defect != nullptr ? defect : defect_of_topology(level);
}

}  // namespace tandem::test
