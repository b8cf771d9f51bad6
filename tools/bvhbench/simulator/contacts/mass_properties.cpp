#include "mass_properties.h"

#include <Eigen/Dense>
#include <algorithm>
#include <stdexcept>

#include "surface.h"

namespace tandem::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A volume below this part of the diagonal's cube is rounding.
constexpr double kFlat = 1e-13;

// Adds and keeps what each addition rounds off, to add it in the end: Knuth's two-sum, entry by entry.
template <typename Value>
class Sum {
 public:
  explicit Sum(const Value& zero) : sum_(zero), lost_(zero) {}

  void add(const Value& value) {
    const Value next = sum_ + value;
    const Value rest = next - sum_;
    lost_ += (sum_ - (next - rest)) + (value - rest);
    sum_ = next;
  }
  Value value() const { return sum_ + lost_; }

 private:
  Value sum_, lost_;
};

// Integrals of 1, x and x x^T over a body or a surface.
struct Moments {
  double zeroth;
  Vector3d first;
  Matrix3d second;
};

Matrix3d product(const Vector3d& x) {
  return x * x.transpose();
}

// Of the tetrahedron between the origin and a triangle: exact, since a polynomial of degree 2 over a simplex
// is a mean over its corners and their sum (Eberly 2002, "Polyhedral mass properties", gives the same).
Moments solid_moments(const Vector3d& p, const Vector3d& q, const Vector3d& r) {
  const double volume = p.dot(q.cross(r)) / 6;
  const Vector3d sum = p + q + r;
  return {volume, volume / 4 * sum, volume / 20 * (product(p) + product(q) + product(r) + product(sum))};
}

// Of the triangle itself.
Moments shell_moments(const Vector3d& p, const Vector3d& q, const Vector3d& r) {
  const double area = (q - p).cross(r - p).norm() / 2;
  const Vector3d sum = p + q + r;
  return {area, area / 3 * sum, area / 12 * (product(p) + product(q) + product(r) + product(sum))};
}

// The middle of the bounds: what integrals are taken about, so that nothing large cancels.
Vector3d middle(const FileHeader& header) {
  const Vector3d lower(header.lower[0], header.lower[1], header.lower[2]);
  const Vector3d upper(header.upper[0], header.upper[1], header.upper[2]);
  return (lower + upper) / 2;
}

double diagonal(const FileHeader& header) {
  Vector3d extent;
  for (int k = 0; k < 3; ++k) extent[k] = static_cast<double>(header.upper[k]) - header.lower[k];
  return extent.norm();
}

template <typename Of>
Moments integrate(const Surface& surface, const Vector3d& about, const Of& of) {
  Sum<double> zeroth(0);
  Sum<Vector3d> first(Vector3d::Zero());
  Sum<Matrix3d> second(Matrix3d::Zero());
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    Vector3d x[3];
    for (int k = 0; k < 3; ++k) {
      const auto& position = surface.position[surface.corner[t][k]];
      x[k] = Vector3d(position[0], position[1], position[2]) - about;
    }
    if (surface.turned[t] != 0) std::swap(x[1], x[2]);
    const Moments part = of(x[0], x[1], x[2]);
    zeroth.add(part.zeroth);
    first.add(part.first);
    second.add(part.second);
  }
  return {zeroth.value(), first.value(), second.value()};
}

// thickness: what a mass per area is multiplied by; 1 of solids.
MassProperties properties_of(const Moments& moments, const Vector3d& about, const double* origin,
                             double thickness) {
  const Vector3d center = moments.first / moments.zeroth;
  const Matrix3d spread = thickness * (moments.second - moments.zeroth * product(center));
  MassProperties properties;
  properties.volume = thickness * moments.zeroth;
  properties.center = Vector3d(origin[0], origin[1], origin[2]) + (about + center);
  properties.inertia_per_density = spread.trace() * Matrix3d::Identity() - spread;
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
    findings.push_back(surface.components == 1
                           ? "inside out: taken to be wound the other way"
                           : counted(surface.turned_components, "component is", "components are") +
                                 " inside out and no cavity of another: taken to be wound the other way");
  }
  if (surface.boundary_edges != 0) {
    findings.push_back("open: " + counted(surface.boundary_edges, "boundary edge", "boundary edges"));
  }
  if (surface.components > 1) {
    findings.push_back(counted(surface.components, "component", "components") +
                       ": their masses are added, where they overlap too");
  }
}

}  // namespace

MassReport mass_properties(const AssetView& asset) {
  const Surface surface = make_surface(asset.level());
  const FileHeader& header = *asset.header;
  const Vector3d about = middle(header);
  const double size = diagonal(header);
  MassReport report = {{}, MassModel::solid, surface.components, {}};
  add_findings(surface, report.findings);
  if (surface.closed) {
    const Moments moments = integrate(surface, about, solid_moments);
    if (moments.zeroth > kFlat * size * size * size) {
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

}  // namespace tandem::simulation
