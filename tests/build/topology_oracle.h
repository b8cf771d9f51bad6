#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "tandem/formats/view.h"

/// What the checker promises of a level's topology, found out in another way: with maps of positions and
/// edges, and by walking from triangle to triangle.
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
  std::map<std::array<float, 3>, std::uint32_t> at;
  for (std::uint32_t side = 0; side < 3 * level.triangle_count; ++side) {
    const float* p = level.triangles[side / 3].corner[side % 3].position;
    const auto number = static_cast<std::uint32_t>(at.size());
    if (at.try_emplace({p[0], p[1], p[2]}, number).first->second != level.topology[side / 3].vertex[side % 3])
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

/// What is wrong with the topology of a level whose triangles are sound, or null. Slow: small meshes.
inline const char* defect_of_topology(const LevelView& level) {
  using namespace topology_oracle_detail;
  if (const char* defect = defect_of_vertices(level)) return defect;
  const Edges edges = edges_of(level);
  if (const char* defect = defect_of_edges(level, edges)) return defect;
  if (const char* defect = defect_of_components(level, edges)) return defect;
  return defect_of_windings(level, edges);
}

}  // namespace tandem::test
