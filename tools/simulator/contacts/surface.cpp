#include "surface.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <tuple>
#include <unordered_map>

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

struct PositionHash {
  std::size_t operator()(const std::array<float, 3>& p) const {
    std::uint64_t hash = 0;
    for (const float x : p) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &x, sizeof bits);
      hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

void weld(const LevelView& level, Surface& surface) {
  std::unordered_map<std::array<float, 3>, std::uint32_t, PositionHash> vertex_at;
  vertex_at.reserve(level.triangle_count);
  surface.corner.reserve(level.triangle_count);
  for (const Triangle& triangle : std::span(level.triangles, level.triangle_count)) {
    auto& corners = surface.corner.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const float* p = triangle.corner[k].position;
      const std::array<float, 3> position = {p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f};  // -0 is 0
      const auto [found, is_new] = vertex_at.try_emplace(position, surface.vertex_count());
      if (is_new) surface.position.push_back(position);
      corners[k] = found->second;
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

// Triangles that have an edge, by edge.
struct EdgeTriangles {
  std::vector<std::uint32_t> begin, triangle;

  explicit EdgeTriangles(const Surface& surface) : begin(surface.edge.size() + 1, 0) {
    for (std::size_t e = 0; e < surface.edge.size(); ++e) begin[e + 1] = begin[e] + surface.edge[e].triangles;
    triangle.resize(begin.back());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
      for (const std::uint32_t e : surface.edge_of[t]) triangle[next[e]++] = t;
    }
  }
  std::span<const std::uint32_t> of(std::uint32_t e) const {
    return std::span(triangle).subspan(begin[e], begin[e + 1] - begin[e]);
  }
};

// Whether triangle t, as it is marked, runs along its edge k from the lower to the upper vertex.
bool runs_up(const Surface& surface, std::uint32_t t, std::uint32_t k) {
  return (surface.corner[t][k] < surface.corner[t][(k + 1) % 3]) != (surface.turned[t] != 0);
}

bool runs_up_along(const Surface& surface, std::uint32_t t, std::uint32_t edge) {
  const auto& edges = surface.edge_of[t];
  return runs_up(surface, t, edges[0] == edge ? 0 : edges[1] == edge ? 1 : 2);
}

// Numbers the component of `seed` and makes windings agree with the seed's across edges of two triangles.
void flood(const EdgeTriangles& edges, std::uint32_t seed, Surface& surface,
           std::vector<std::uint32_t>& members) {
  members.assign(1, seed);
  surface.component[seed] = surface.components;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const std::uint32_t t = members[i];
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t edge = surface.edge_of[t][k];
      for (const std::uint32_t other : edges.of(edge)) {
        if (surface.component[other] != kNoIndex) continue;
        surface.component[other] = surface.components;
        const bool pair = surface.edge[edge].triangles == 2;
        surface.turned[other] = pair && runs_up(surface, t, k) == runs_up_along(surface, other, edge);
        members.push_back(other);
      }
    }
  }
}

void orient_components(const EdgeTriangles& edges, Surface& surface) {
  surface.component.assign(surface.corner.size(), kNoIndex);
  surface.turned.assign(surface.corner.size(), 0);
  std::vector<std::uint32_t> members;
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    if (surface.component[t] != kNoIndex) continue;
    flood(edges, t, surface, members);
    ++surface.components;
    const auto turned = static_cast<std::size_t>(
        std::count_if(members.begin(), members.end(), [&](auto m) { return surface.turned[m] != 0; }));
    const bool most = 2 * turned > members.size();
    if (most) {
      for (const std::uint32_t m : members) surface.turned[m] ^= 1;
    }
    surface.turned_triangles += most ? members.size() - turned : turned;
  }
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

struct Corners {
  Vector3d p, q, r;
};

Corners corners_of(const Surface& surface, std::uint32_t t, const Vector3d& origin) {
  const auto at = [&](int k) {
    const auto& p = surface.position[surface.corner[t][k]];
    return Vector3d(Vector3d(p[0], p[1], p[2]) - origin);
  };
  return surface.turned[t] != 0 ? Corners{at(0), at(2), at(1)} : Corners{at(0), at(1), at(2)};
}

// Six times the volume that each component encloses, negative where it is inside out.
std::vector<double> volumes(const Surface& surface) {
  std::vector<double> volume(surface.components, 0);
  std::vector<Vector3d> origin(surface.components);
  std::vector<std::uint8_t> known(surface.components, 0);
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    const std::uint32_t c = surface.component[t];
    if (known[c] == 0) {
      known[c] = 1;
      origin[c] = corners_of(surface, t, Vector3d::Zero()).p;
    }
    const Corners x = corners_of(surface, t, origin[c]);
    volume[c] += x.p.dot(x.q.cross(x.r));
  }
  return volume;
}

// How often the components other than `own` wind around a point; those that are inside out count as turned.
double winding(const Surface& surface, const Vector3d& point, std::uint32_t own,
               const std::vector<double>& volume) {
  double angle = 0;
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    const std::uint32_t c = surface.component[t];
    if (c == own) continue;
    const Corners x = corners_of(surface, t, point);
    const double a = x.p.norm(), b = x.q.norm(), d = x.r.norm();
    const double tangent = std::atan2(x.p.dot(x.q.cross(x.r)),
                                      a * b * d + x.p.dot(x.q) * d + x.q.dot(x.r) * a + x.r.dot(x.p) * b);
    angle += volume[c] < 0 ? -tangent : tangent;
  }
  return angle / (2 * 3.14159265358979323846);
}

// Turns closed components that are inside out and no cavities.
void turn_components(Surface& surface) {
  if (!surface.closed) return;
  const std::vector<double> volume = volumes(surface);
  std::vector<std::uint8_t> turn(surface.components, 0), seen(surface.components, 0);
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    const std::uint32_t c = surface.component[t];
    if (seen[c] != 0 || volume[c] >= 0) continue;
    seen[c] = 1;
    const Vector3d vertex = corners_of(surface, t, Vector3d::Zero()).p;
    turn[c] = surface.components == 1 || winding(surface, vertex, c, volume) < 0.5;
    surface.turned_components += turn[c];
  }
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    surface.turned[t] ^= turn[surface.component[t]];
  }
}

}  // namespace

Surface make_surface(const LevelView& level) {
  Surface surface;
  weld(level, surface);
  find_edges(surface);
  find_surroundings(surface);
  orient_components(EdgeTriangles(surface), surface);
  count_defects(surface);
  turn_components(surface);
  return surface;
}

}  // namespace tandem::simulation
