#include "surface_topology.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "bvhbuild/meshing/index_table.h"
#include "parallel/parallel.h"
#include "tandem/formats/enclosed_volume.h"

namespace tandem::build {
namespace {

constexpr std::size_t kVerticesAtOnce = 1 << 14;

// A side of a triangle, without its lower vertex.
struct Side {
  std::uint32_t upper, side;

  bool operator<(const Side& other) const {
    return upper != other.upper ? upper < other.upper : side < other.side;
  }
};

// The sides of all triangles but those from a vertex to itself, by lower vertex, upper vertex and number.
struct SortedSides {
  std::vector<std::uint32_t> first;  // of each lower vertex, and the end
  std::vector<Side> sides;

  explicit SortedSides(std::span<const TriangleTopology> triangles) {
    std::uint32_t vertices = 0;
    for (const TriangleTopology& triangle : triangles)
      vertices =
          std::max(vertices, 1 + std::max({triangle.vertex[0], triangle.vertex[1], triangle.vertex[2]}));
    first.assign(vertices + 1, 0);
    for_each_side(triangles, [&](std::uint32_t lower, const Side&) { ++first[lower]; });
    std::inclusive_scan(first.begin(), first.end(), first.begin());
    sides.resize(first.back());
    for_each_side(triangles, [&](std::uint32_t lower, const Side& side) { sides[--first[lower]] = side; });
    parallel::for_parts(vertices, kVerticesAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v != end; ++v)
        std::sort(sides.begin() + first[v], sides.begin() + first[v + 1]);
    });
  }

 private:
  template <typename Visit>
  static void for_each_side(std::span<const TriangleTopology> triangles, const Visit& visit) {
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t u = triangles[t].vertex[k], v = triangles[t].vertex[(k + 1) % 3];
        if (u != v) visit(std::min(u, v), {std::max(u, v), 3 * t + k});
      }
    }
  }
};

}  // namespace

SurfaceEdges::SurfaceEdges(std::span<const TriangleTopology> triangles) : edge_(3 * triangles.size(), kNone) {
  const SortedSides sorted(triangles);
  sides_.reserve(sorted.sides.size());
  for (std::size_t vertex = 0; vertex + 1 < sorted.first.size(); ++vertex) {
    for (std::uint32_t i = sorted.first[vertex]; i < sorted.first[vertex + 1]; ++i) {
      if (i == sorted.first[vertex] || sorted.sides[i].upper != sorted.sides[i - 1].upper)
        first_.push_back(i);
      edge_[sorted.sides[i].side] = static_cast<std::uint32_t>(first_.size() - 1);
      sides_.push_back(sorted.sides[i].side);
    }
  }
  first_.push_back(static_cast<std::uint32_t>(sides_.size()));
}

namespace {

using Double3 = std::array<double, 3>;

// These directions have no special slope, since meshes love axes, diagonals and symmetric shapes. All parts
// are positive.
constexpr Double3 kDirections[] = {{0.7548776662, 0.5698402910, 0.3247179572},
                                   {0.2955977425, 0.8191725134, 0.4914180613},
                                   {0.4422495703, 0.1442249570, 0.8851680193},
                                   {0.5436890127, 0.6477988713, 0.5330099681}};

// A triple product and whether its sign is that of the exact one.
struct Sign {
  double value;
  bool sure;
};

// Each product meets seven roundings at most, differences of the corners included, and the sum five more.
Sign triple_product(const Double3& a, const Double3& b, const Double3& c) {
  double value = 0, magnitude = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    value += c[k] * (a[l] * b[m] - a[m] * b[l]);
    magnitude += std::abs(c[k]) * (std::abs(a[l] * b[m]) + std::abs(a[m] * b[l]));
  }
  return {value, std::abs(value) > 16 * 0x1p-53 * magnitude};
}

// Returns whether a ray from the point meets a box, or might but for roundings.
bool may_meet(const Block& block, int node, const Double3& from, const Double3& direction) {
  double first = 0, last = HUGE_VAL;
  for (std::size_t k = 0; k < 3; ++k) {
    const double c = block.centre[k][node], h = block.half_extent[k][node];
    const double slack = 0x1p-40 * (std::abs(c) + h + std::abs(from[k]));
    first = std::max(first, ((c - from[k]) - h - slack) / direction[k]);
    last = std::min(last, ((c - from[k]) + h + slack) / direction[k]);
  }
  return first <= last;
}

enum class Crossing : std::uint8_t { none, in, out, unsure };

// Returns how a ray from 0 crosses a triangle.
Crossing crossing(const std::array<Double3, 3>& corner, const Double3& direction) {
  int positive = 0, negative = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Sign side = triple_product(corner[k], corner[(k + 1) % 3], direction);
    if (side.sure) ++(side.value > 0 ? positive : negative);
  }
  if (positive > 0 && negative > 0) return Crossing::none;
  const Sign plane = triple_product(corner[0], corner[1], corner[2]);
  if (positive + negative < 3 || !plane.sure) return Crossing::unsure;
  if ((plane.value > 0) != (positive > 0)) return Crossing::none;  // behind
  return positive > 0 ? Crossing::out : Crossing::in;
}

// Finds how often a surface winds around a point, by the triangles that a ray from it crosses.
class Enclosure {
 public:
  // component: of each triangle in leaf order. weight: of each, 1 where its corners go round against the
  // clock as seen from outside, -1 where they go the other way, 0 where it does not count. All arguments
  // must outlive this. Condition: the triangles that count are closed surfaces.
  Enclosure(const Geometry& geometry, const Tree& tree, std::span<const std::uint32_t> component,
            std::span<const std::int8_t> weight)
      : geometry_(geometry), tree_(tree), component_(component), weight_(weight) {}

  // The winding number of the triangles that count around a point, those of the component `own` left out;
  // nothing where the point is so near to a triangle, or rays to edges, that roundings would decide.
  std::optional<int> around(const std::array<float, 3>& point, std::uint32_t own) const {
    const Double3 from = {point[0], point[1], point[2]};
    const auto corners_of = [&](std::uint32_t t) {
      std::array<Double3, 3> corner;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto& p = geometry_.points[geometry_.triangles[tree_.order[t]][i]];
        for (std::size_t k = 0; k < 3; ++k) corner[i][k] = double{p[k]} - from[k];
      }
      return corner;
    };
    std::vector<std::uint32_t> pending;
    for (const Double3& direction : kDirections) {
      int winding = 0;
      bool sure = true;
      pending.assign(1, 0);
      while (sure && !pending.empty()) {
        const Block& block = tree_.blocks[pending.back()];
        pending.pop_back();
        for (int i = 0; i < kNodesPerBlock && sure; ++i) {
          if (block.kind[i] == NodeKind::imaginary || !may_meet(block, i, from, direction)) continue;
          const std::uint32_t below = block.index[i];
          if (block.kind[i] == NodeKind::internal) {
            pending.push_back(below);
          } else if (weight_[below] != 0 && component_[below] != own) {
            const Crossing how = crossing(corners_of(below), direction);
            sure = how != Crossing::unsure;
            winding += how == Crossing::out ? weight_[below] : how == Crossing::in ? -weight_[below] : 0;
          }
        }
      }
      if (sure) return winding;
    }
    return std::nullopt;
  }

 private:
  Geometry geometry_;
  const Tree& tree_;
  std::span<const std::uint32_t> component_;
  std::span<const std::int8_t> weight_;
};

std::uint64_t hash_position(const std::array<float, 3>& p) {
  const auto bits = [](float x) { return std::uint64_t{std::bit_cast<std::uint32_t>(x + 0.0f)}; };  // -0 is 0
  return hash_words(bits(p[0]), bits(p[1]), bits(p[2]));
}

// The first point that lies where each point does, in all poses too.
std::vector<std::uint32_t> first_at_position(const Geometry& geometry) {
  const auto& points = geometry.points;
  IndexTable table(points.size());
  std::vector<std::uint32_t> first(points.size());
  const auto hash = [&](std::size_t i) {
    std::uint64_t hash_i = hash_position(points[i]);
    for (const StoredPoints& pose : geometry.poses) hash_i = hash_words(hash_i, hash_position(pose[i]), 0);
    return hash_i;
  };
  for_each_prefetched(points.size(), table, hash, [&](std::uint32_t i, std::uint64_t hash_i) {
    first[i] = table.find_or_insert(hash_i, i, [&](std::uint32_t other) {
      return points[other] == points[i] &&
             std::all_of(geometry.poses.begin(), geometry.poses.end(),
                         [&](const StoredPoints& pose) { return pose[other] == pose[i]; });
    });
  });
  return first;
}

void weld(const Geometry& geometry, const Tree& tree, SurfaceTopology& surface) {
  const std::vector<std::uint32_t> first = first_at_position(geometry);
  std::vector<std::uint32_t> vertex(geometry.points.size(), kNoIndex);
  surface.triangles.reserve(tree.order.size());
  for (const std::uint32_t source : tree.order) {
    TriangleTopology& triangle = surface.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t point = first[geometry.triangles[source][k]];
      std::uint32_t& number = vertex[point];
      if (number == kNoIndex) {
        number = surface.vertex_count++;
        surface.point.push_back(point);
      }
      triangle.vertex[k] = number;
    }
  }
}

void flag_edges(const SurfaceEdges& edges, SurfaceTopology& surface) {
  for (std::uint32_t e = 0; e < edges.count(); ++e) {
    const auto sides = edges.sides_of(e);
    if (sides.size() == 2) continue;
    const std::uint32_t flag = sides.size() == 1 ? kBoundaryEdge0 : kManyTriangles0;
    for (const std::uint32_t side : sides) surface.triangles[side / 3].flags |= flag << side % 3;
  }
}

// The component of each triangle.
using Components = std::vector<std::uint32_t>;

// Walks over a component, patch by patch: a patch is what edges of two sides join. In each, windings are made
// to agree, the larger part keeping its own; of two halves, the one that is met first.
class Flood {
 public:
  Flood(const SurfaceEdges& edges, SurfaceTopology& surface, Components& component)
      : edges_(edges), surface_(surface), component_(component), crossed_(edges.count(), 0) {}

  /// Numbers the component of `seed`. Result: how many triangles it has.
  std::uint32_t run(std::uint32_t seed, std::uint32_t number) {
    members_.clear();
    number_ = number;
    meet_patch(seed);
    for (std::size_t i = 0; i < members_.size(); ++i) cross_edges_of(members_[i]);
    return static_cast<std::uint32_t>(members_.size());
  }

 private:
  // Looks at each edge once, since any number of triangles may have it.
  void cross_edges_of(std::uint32_t triangle) {
    for (std::uint32_t side = 3 * triangle; side < 3 * triangle + 3; ++side) {
      const std::uint32_t edge = edges_.edge_of(side);
      if (edge == SurfaceEdges::kNone || crossed_[edge] != 0) continue;
      crossed_[edge] = 1;
      for (const std::uint32_t other : edges_.sides_of(edge)) {
        if (component_[other / 3] == kNoIndex) meet_patch(other / 3);
      }
    }
  }

  void meet(std::uint32_t triangle) {
    component_[triangle] = number_;
    members_.push_back(triangle);
  }

  // Makes windings agree with those of `triangle`.
  void meet_neighbours(std::uint32_t triangle) {
    for (std::uint32_t side = 3 * triangle; side < 3 * triangle + 3; ++side) {
      const std::uint32_t edge = edges_.edge_of(side);
      if (edge == SurfaceEdges::kNone || edges_.sides_of(edge).size() != 2) continue;
      const auto sides = edges_.sides_of(edge);
      const std::uint32_t other = sides[0] == side ? sides[1] : sides[0];
      if (component_[other / 3] != kNoIndex) continue;
      if (runs_up(surface_.triangles, side) == runs_up(surface_.triangles, other))
        surface_.triangles[other / 3].flags ^= kTurned;
      meet(other / 3);
    }
  }

  void meet_patch(std::uint32_t seed) {
    const std::size_t first = members_.size();
    meet(seed);
    for (std::size_t i = first; i < members_.size(); ++i) meet_neighbours(members_[i]);
    const auto patch = std::span(members_).subspan(first);
    const auto turned = std::count_if(patch.begin(), patch.end(),
                                      [&](auto t) { return is_turned(surface_.triangles[t].flags); });
    if (2 * static_cast<std::size_t>(turned) <= patch.size()) return;
    for (const std::uint32_t t : patch) surface_.triangles[t].flags ^= kTurned;
  }

  const SurfaceEdges& edges_;
  SurfaceTopology& surface_;
  Components& component_;
  std::vector<std::uint8_t> crossed_;  // of each edge
  std::vector<std::uint32_t> members_;
  std::uint32_t number_ = 0;
};

Components orient_components(const SurfaceEdges& edges, SurfaceTopology& surface) {
  Components component(surface.triangles.size(), kNoIndex);
  Flood flood(edges, surface, component);
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    if (component[t] != kNoIndex) continue;
    const std::uint32_t triangles = flood.run(t, static_cast<std::uint32_t>(surface.components.size()));
    surface.components.push_back({t, triangles, kClosedComponent, 0});
  }
  return component;
}

void find_closed(const SurfaceEdges& edges, const Components& component, SurfaceTopology& surface) {
  for (std::uint32_t e = 0; e < edges.count(); ++e) {
    const auto sides = edges.sides_of(e);
    const auto up =
        std::count_if(sides.begin(), sides.end(), [&](auto s) { return runs_up(surface.triangles, s); });
    if (2 * static_cast<std::size_t>(up) != sides.size())
      surface.components[component[sides[0] / 3]].flags &= ~kClosedComponent;
  }
  surface.closed = std::all_of(surface.components.begin(), surface.components.end(), is_closed);
}

// Triangles of the input, in leaf order.
class Corners {
 public:
  Corners(const Geometry& geometry, const Tree& tree) : geometry_(geometry), tree_(tree) {}

  const std::array<float, 3>& at(std::uint32_t triangle, std::size_t k) const {
    return geometry_.points[geometry_.triangles[tree_.order[triangle]][k]];
  }

 private:
  Geometry geometry_;
  const Tree& tree_;
};

// Returns for each component whether it is closed and inside out.
std::vector<std::uint8_t> inside_out(const Corners& corners, const Components& component,
                                     const SurfaceTopology& surface) {
  std::vector<EnclosedVolume> volumes;
  for (const SurfaceComponent& of : surface.components)
    volumes.emplace_back(corners.at(of.first_triangle, 0).data());
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    const std::size_t turned = is_turned(surface.triangles[t].flags);
    volumes[component[t]].add(corners.at(t, 0).data(), corners.at(t, 1 + turned).data(),
                              corners.at(t, 2 - turned).data());
  }
  std::vector<std::uint8_t> inside_out(volumes.size());
  for (std::size_t c = 0; c < volumes.size(); ++c)
    inside_out[c] = is_closed(surface.components[c]) && volumes[c].is_inside_out();
  return inside_out;
}

// The triangles of each component.
class Members {
 public:
  Members(const Components& component, const SurfaceTopology& surface) : triangles_(component.size()) {
    first_.push_back(0);
    for (const SurfaceComponent& of : surface.components) first_.push_back(first_.back() + of.triangle_count);
    std::vector<std::uint32_t> next(first_);
    for (std::uint32_t t = 0; t < component.size(); ++t) triangles_[next[component[t]]++] = t;
  }
  std::span<const std::uint32_t> of(std::uint32_t component) const {
    return std::span(triangles_).subspan(first_[component], first_[component + 1] - first_[component]);
  }

 private:
  std::vector<std::uint32_t> first_, triangles_;
};

// Returns whether a component lies within others. A corner of each of its triangles is tried until one is far
// enough from all of them.
bool is_cavity(const Corners& corners, const Enclosure& others, std::uint32_t own,
               std::span<const std::uint32_t> members) {
  constexpr std::size_t kTries = 16;
  for (const std::uint32_t t : members.first(std::min(members.size(), kTries))) {
    if (const auto winding = others.around(corners.at(t, 0), own); winding.has_value()) return *winding > 0;
  }
  return false;
}

// Turns closed components that are inside out and no cavities.
void turn_components(const Geometry& geometry, const Tree& tree, const Components& component,
                     SurfaceTopology& surface) {
  const Corners corners(geometry, tree);
  const std::vector<std::uint8_t> wrong = inside_out(corners, component, surface);
  if (std::none_of(wrong.begin(), wrong.end(), [](auto w) { return w != 0; })) return;
  std::vector<std::int8_t> weight(component.size());  // what is inside out counts as turned
  for (std::uint32_t t = 0; t < weight.size(); ++t) {
    if (!is_closed(surface.components[component[t]])) continue;
    weight[t] = is_turned(surface.triangles[t].flags) != (wrong[component[t]] != 0) ? -1 : 1;
  }
  const Enclosure enclosure(geometry, tree, component, weight);
  const Members members(component, surface);
  for (std::uint32_t c = 0; c < wrong.size(); ++c) {
    if (wrong[c] == 0 || is_cavity(corners, enclosure, c, members.of(c))) continue;
    for (const std::uint32_t t : members.of(c)) surface.triangles[t].flags ^= kTurned;
  }
}

}  // namespace

SurfaceTopology make_topology(const Geometry& geometry, const Tree& tree) {
  SurfaceTopology surface;
  weld(geometry, tree, surface);
  const SurfaceEdges edges(surface.triangles);
  flag_edges(edges, surface);
  const Components component = orient_components(edges, surface);
  find_closed(edges, component, surface);
  turn_components(geometry, tree, component, surface);
  return surface;
}

}  // namespace tandem::build
