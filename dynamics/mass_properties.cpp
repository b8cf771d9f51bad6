#include "dynamics/mass_properties.h"

#include <algorithm>
#include <stdexcept>
#include <tuple>

#include "kernels/common/union_find.h"

namespace tandem::dynamics {
namespace {

/// The surface of a level: how its triangles hang together, and what is amiss with it.
struct Surface {
  /// Two vertices that one triangle or more have in common, lower < upper.
  struct Edge {
    std::uint32_t lower, upper;
    std::uint32_t triangles;  ///< that have it
  };

  LevelView level;
  std::vector<std::array<std::uint32_t, 3>> edge_of = {};  ///< edges of each triangle, by its sides
  std::vector<Edge> edge = {};

  std::uint64_t boundary_edges = 0;  ///< of an odd number of triangles
  std::uint64_t contradicting_edges =
      0;                                ///< that triangles do not run along in both directions equally often
  std::uint64_t turned_components = 0;  ///< inside out as a whole
  std::uint64_t turned_triangles = 0;   ///< beside the rest of their component, so that windings agree
  bool orientable = true;               ///< windings agree, once what is marked as turned is
  bool closed = true;                   ///< every edge is run along equally often in both directions, then

  std::span<const TriangleTopology> triangles() const { return {level.topology, level.triangle_count}; }
};

void find_edges(Surface& surface) {
  struct Side {
    std::uint32_t lower, upper, place;  // place: 3 * triangle + k
  };
  std::vector<Side> sides;
  const std::span<const TriangleTopology> triangles = surface.triangles();
  sides.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t u = triangles[t].vertex[k], v = triangles[t].vertex[(k + 1) % 3];
      sides.push_back({std::min(u, v), std::max(u, v), 3 * t + k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::tie(x.lower, x.upper, x.place) < std::tie(y.lower, y.upper, y.place);
  });
  surface.edge_of.resize(triangles.size());
  for (const Side& side : sides) {
    const bool same = !surface.edge.empty() && surface.edge.back().lower == side.lower &&
                      surface.edge.back().upper == side.upper;
    if (!same) surface.edge.push_back({side.lower, side.upper, 0});
    ++surface.edge.back().triangles;
    surface.edge_of[side.place / 3][side.place % 3] = static_cast<std::uint32_t>(surface.edge.size() - 1);
  }
}

// Counts what is turned: whole components, or triangles beside the rest of their component.
void count_turned(Surface& surface) {
  const LevelView& level = surface.level;
  UnionFind triangles(level.triangle_count);  // of each component
  std::vector<std::uint32_t> first(surface.edge.size(), kNoIndex);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    for (const std::uint32_t e : surface.edge_of[t]) {
      if (first[e] == kNoIndex) first[e] = t;
      triangles.join(t, first[e]);
    }
  }
  std::vector<std::uint32_t> turned(level.triangle_count, 0);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t)
    turned[triangles.find(t)] += is_turned(level.topology[t].flags);
  for (const SurfaceComponent& component : std::span(level.components, level.component_count)) {
    const std::uint32_t t = component.first_triangle, all = component.triangle_count;
    const bool most = 2 * turned[t] > all || (2 * turned[t] == all && is_turned(level.topology[t].flags));
    surface.turned_components += most;
    surface.turned_triangles += most ? all - turned[t] : turned[t];
  }
}

// Returns how often each edge is run along upwards less downwards, as triangles are marked or as they are.
std::vector<int> balance(const Surface& surface, bool as_marked) {
  std::vector<int> sum(surface.edge.size(), 0);
  for (std::uint32_t t = 0; t < surface.level.triangle_count; ++t) {
    TriangleTopology triangle = surface.level.topology[t];
    if (!as_marked) triangle.flags = 0;
    for (std::uint32_t k = 0; k < 3; ++k) sum[surface.edge_of[t][k]] += runs_up(triangle, k) ? 1 : -1;
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

// Throws std::runtime_error where the level has no topology.
Surface make_surface(const LevelView& level) {
  if (level.topology == nullptr)
    throw std::runtime_error("the asset has no topology: build it without --no-topology");
  Surface surface = {level};
  find_edges(surface);
  count_turned(surface);
  count_defects(surface);
  return surface;
}

// A volume below this part of the diagonal's cube is rounding.
constexpr double kFlatVolume = 1e-13;

// Adds and keeps what each addition rounds off, to add it in the end: Knuth's two-sum, entry by entry.
template <typename Value>
class Sum {
 public:
  explicit Sum(const Value& zero) : sum_(zero), lost_(zero) {}

  void add(const Value& value) {
    const Value next = sum_ + value;
    const Value rest = next - sum_;
    lost_ = lost_ + ((sum_ - (next - rest)) + (value - rest));
    sum_ = next;
  }
  Value value() const { return sum_ + lost_; }

 private:
  Value sum_, lost_;
};

// Integrals of 1, x and x x^T over a body or a surface.
struct Moments {
  double zeroth;
  Vector3 first;
  Matrix3 second;
};

Matrix3 product(const Vector3& x) {
  return outer(x, x);
}

// Returns the moments of the tetrahedron between the origin and a triangle. They are exact, since a
// polynomial of degree 2 over a simplex is a mean over its corners and their sum (Eberly 2002, "Polyhedral
// mass properties", gives the same).
Moments solid_moments(const Vector3& p, const Vector3& q, const Vector3& r) {
  const double volume = dot(p, cross(q, r)) / 6;
  const Vector3 sum = p + q + r;
  return {volume, volume / 4 * sum, volume / 20 * (product(p) + product(q) + product(r) + product(sum))};
}

// Returns the moments of the triangle itself.
Moments shell_moments(const Vector3& p, const Vector3& q, const Vector3& r) {
  const double area = norm(cross(q - p, r - p)) / 2;
  const Vector3 sum = p + q + r;
  return {area, area / 3 * sum, area / 12 * (product(p) + product(q) + product(r) + product(sum))};
}

// The middle of the bounds: what integrals are taken about, so that nothing large cancels.
Vector3 middle(const FileHeader& header) {
  return (vector_of(header.lower) + vector_of(header.upper)) / 2;
}

double diagonal(const FileHeader& header) {
  return norm(vector_of(header.upper) - vector_of(header.lower));
}

template <typename Of>
Moments integrate(const Surface& surface, const Vector3& about, const Of& of) {
  Sum<double> zeroth(0);
  Sum<Vector3> first(Vector3{});
  Sum<Matrix3> second(Matrix3{});
  for (std::uint32_t t = 0; t < surface.level.triangle_count; ++t) {
    Vector3 x[3];
    for (int k = 0; k < 3; ++k) {
      x[k] = vector_of(surface.level.triangles[t].corner[k].position) - about;
    }
    if (is_turned(surface.level.topology[t].flags)) std::swap(x[1], x[2]);
    const Moments part = of(x[0], x[1], x[2]);
    zeroth.add(part.zeroth);
    first.add(part.first);
    second.add(part.second);
  }
  return {zeroth.value(), first.value(), second.value()};
}

// thickness: what a mass per area is multiplied by; 1 of solids.
MassProperties properties_of(const Moments& moments, const Vector3& about, const double* origin,
                             double thickness) {
  const Vector3 centre = moments.first / moments.zeroth;
  const Matrix3 spread = thickness * (moments.second - moments.zeroth * product(centre));
  MassProperties properties;
  properties.volume = thickness * moments.zeroth;
  properties.centre = Vector3{origin[0], origin[1], origin[2]} + (about + centre);
  properties.inertia_per_density = trace(spread) * Matrix3::identity() - spread;
  return properties;
}

std::string counted(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

void add_findings(const Surface& surface, std::vector<std::string>& findings) {
  if (surface.contradicting_edges != 0) {
    findings.push_back(
        "windings contradict each other along " + counted(surface.contradicting_edges, "edge", "edges") +
        (surface.orientable
             ? ": " + counted(surface.turned_triangles, "triangle is taken", "triangles are taken") +
                   " to be wound the other way"
             : ", and no winding makes them agree"));
  }
  if (surface.turned_components != 0) {
    findings.push_back(surface.level.component_count == 1
                           ? "inside out: taken to be wound the other way"
                           : counted(surface.turned_components, "component is", "components are") +
                                 " inside out and no cavity of another: taken to be wound the other way");
  }
  if (surface.boundary_edges != 0) {
    findings.push_back("open: " + counted(surface.boundary_edges, "boundary edge", "boundary edges"));
  }
  if (surface.level.component_count > 1) {
    findings.push_back(counted(surface.level.component_count, "component", "components") +
                       ": their masses are added, where they overlap too");
  }
}

}  // namespace

MassReport mass_properties(const AssetView& asset) {
  const Surface surface = make_surface(asset.level());
  const FileHeader& header = *asset.header;
  const Vector3 about = middle(header);
  const double size = diagonal(header);
  MassReport report = {{}, MassModel::solid, surface.level.component_count, {}};
  add_findings(surface, report.findings);
  if (surface.closed) {
    const Moments moments = integrate(surface, about, solid_moments);
    if (moments.zeroth > kFlatVolume * size * size * size) {
      report.properties = properties_of(moments, about, header.origin, 1);
      return report;
    }
    report.findings.push_back("encloses no volume");
  }
  const Moments moments = integrate(surface, about, shell_moments);
  if (!(moments.zeroth > 0)) throw std::runtime_error("the mesh has no extent, and so no mass");
  report.model = MassModel::shell;
  report.findings.push_back("taken for a shell, its thickness a hundredth of the mesh's diagonal");
  report.properties = properties_of(moments, about, header.origin, kShellThickness * size);
  return report;
}

double radius_about(const Vector3& centre, const AssetView& asset) {
  const LevelView level = asset.level();
  const Vector3 from = centre - vector_of(asset.header->origin);
  double most = 0;
  for (const Triangle& triangle : std::span(level.triangles, level.triangle_count)) {
    for (const Triangle::Corner& corner : triangle.corner)
      most = std::max(most, square(vector_of(corner.position) - from));
  }
  return std::sqrt(most);
}

std::vector<double> inner_radii(std::span<const AssetView> shapes) {
  std::vector<double> out;
  for (const AssetView& shape : shapes) {
    double least = INFINITY;
    for (int k = 0; k < 3; ++k) {
      const double side =
          static_cast<double>(shape.header->upper[k]) - static_cast<double>(shape.header->lower[k]);
      if (shape.level().closed) least = std::min(least, 0.5 * side);
    }
    out.push_back(least);
  }
  return out;
}

}  // namespace tandem::dynamics
