#include "surface.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <tuple>

namespace tandem::simulation {
namespace {

void take_vertices(const LevelView& level, Surface& surface) {
  surface.position.resize(level.vertex_count);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    const TriangleTopology& triangle = level.topology[t];
    surface.corner.push_back({triangle.vertex[0], triangle.vertex[1], triangle.vertex[2]});
    surface.turned.push_back(is_turned(triangle.flags));
    for (int k = 0; k < 3; ++k) {
      const float* p = level.triangles[t].corner[k].position;
      surface.position[triangle.vertex[k]] = {p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f};  // -0 is 0
    }
  }
}

void find_edges(Surface& surface) {
  struct Side {
    std::uint32_t lower, upper, place;  // place: 3 * triangle + k
  };
  std::vector<Side> sides;
  sides.reserve(3 * surface.corner.size());
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t u = surface.corner[t][k], v = surface.corner[t][(k + 1) % 3];
      sides.push_back({std::min(u, v), std::max(u, v), 3 * t + k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::tie(x.lower, x.upper, x.place) < std::tie(y.lower, y.upper, y.place);
  });
  surface.edge_of.resize(surface.corner.size());
  for (const Side& side : sides) {
    const bool same = !surface.edge.empty() && surface.edge.back().lower == side.lower &&
                      surface.edge.back().upper == side.upper;
    if (!same) surface.edge.push_back({side.lower, side.upper, 0});
    ++surface.edge.back().triangles;
    surface.edge_of[side.place / 3][side.place % 3] = static_cast<std::uint32_t>(surface.edge.size() - 1);
  }
}

// Lists, vertex by vertex, what names it: list[begin[v]] to list[begin[v + 1] - 1]. names(i): the vertices of
// i.
template <typename Names>
void list_by_vertex(std::uint32_t vertices, std::size_t count, const Names& names,
                    std::vector<std::uint32_t>& begin, std::vector<std::uint32_t>& list) {
  begin.assign(vertices + 1, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const std::uint32_t v : names(i)) ++begin[v + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  list.resize(begin.back());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const std::uint32_t v : names(i)) list[next[v]++] = i;
  }
}

void find_surroundings(Surface& surface) {
  const std::uint32_t vertices = surface.vertex_count();
  list_by_vertex(
      vertices, surface.corner.size(), [&](auto t) { return surface.corner[t]; }, surface.fan_begin,
      surface.fan);
  const auto ends = [&](auto e) {
    return std::array<std::uint32_t, 2>{surface.edge[e].lower, surface.edge[e].upper};
  };
  list_by_vertex(vertices, surface.edge.size(), ends, surface.spoke_begin, surface.spoke);
}

// What is turned: whole components, or triangles beside the rest of their component.
void count_turned(const LevelView& level, Surface& surface) {
  std::vector<std::uint32_t> lower(surface.triangle_count());  // a triangle of the same component, or itself
  std::iota(lower.begin(), lower.end(), 0u);
  const auto lowest = [&](std::uint32_t t) {
    while (lower[t] != t) t = lower[t] = lower[lower[t]];
    return t;
  };
  std::vector<std::uint32_t> first(surface.edge.size(), kNoIndex);
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    for (const std::uint32_t e : surface.edge_of[t]) {
      if (first[e] == kNoIndex) first[e] = t;
      const auto [low, high] = std::minmax({lowest(t), lowest(first[e])});
      lower[high] = low;
    }
  }
  std::vector<std::uint32_t> turned(surface.triangle_count(), 0);
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) turned[lowest(t)] += surface.turned[t];
  for (const SurfaceComponent& component : std::span(level.components, level.component_count)) {
    const std::uint32_t t = component.first_triangle, all = component.triangle_count;
    const bool most = 2 * turned[t] > all || (2 * turned[t] == all && surface.turned[t] != 0);
    surface.turned_components += most;
    surface.turned_triangles += most ? all - turned[t] : turned[t];
  }
}

// Whether triangle t, as it is marked, runs along its edge k from the lower to the upper vertex.
bool runs_up(const Surface& surface, std::uint32_t t, std::uint32_t k) {
  return (surface.corner[t][k] < surface.corner[t][(k + 1) % 3]) != (surface.turned[t] != 0);
}

// How often each edge is run along upwards less downwards, as triangles are marked or as they are.
std::vector<int> balance(const Surface& surface, bool as_marked) {
  std::vector<int> sum(surface.edge.size(), 0);
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const bool up =
          as_marked ? runs_up(surface, t, k) : surface.corner[t][k] < surface.corner[t][(k + 1) % 3];
      sum[surface.edge_of[t][k]] += up ? 1 : -1;
    }
  }
  return sum;
}

void count_defects(Surface& surface) {
  const std::vector<int> before = balance(surface, false);
  for (std::size_t e = 0; e < surface.edge.size(); ++e) {
    const bool odd = surface.edge[e].triangles % 2 != 0;
    surface.boundary_edges += odd;
    surface.contradicting_edges += !odd && before[e] != 0;
  }
  const std::vector<int> after = balance(surface, true);
  for (std::size_t e = 0; e < surface.edge.size(); ++e) {
    if (after[e] == 0) continue;
    surface.closed = false;
    if (surface.edge[e].triangles % 2 == 0) surface.orientable = false;
  }
}

}  // namespace

Surface make_surface(const LevelView& level) {
  if (level.topology == nullptr)
    throw std::runtime_error("the asset has no topology: build it without --no-topology");
  Surface surface;
  surface.components = level.component_count;
  take_vertices(level, surface);
  find_edges(surface);
  find_surroundings(surface);
  count_turned(level, surface);
  count_defects(surface);
  return surface;
}

}  // namespace tandem::simulation
