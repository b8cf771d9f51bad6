#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include "manifold_scene.h"

/// The manifolds of two bodies do not depend on how their surfaces are cut into triangles.
namespace tandem::test {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

/// Splits each triangle into four at the middles of its edges. The surface stays where it is, but for float32.
Mesh subdivided(const Mesh& mesh) {
  Mesh out;
  out.points = mesh.points;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t i, std::uint32_t j) {
    const auto [at, is_new] = middles.emplace(std::minmax(i, j), static_cast<std::uint32_t>(out.points.size()));
    if (is_new) {
      const auto &p = mesh.points[i], &q = mesh.points[j];
      out.points.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
    }
    return at->second;
  };
  for (const auto& [i, j, k] : mesh.triangles) {
    const std::uint32_t ij = middle(i, j), jk = middle(j, k), ki = middle(k, i);
    for (const std::array<std::uint32_t, 3>& part :
         {std::array{i, ij, ki}, {ij, j, jk}, {ki, jk, k}, {ij, jk, ki}})
      out.triangles.push_back(part);
  }
  return out;
}

/// The surface of those cells of a grid that are full. cuts: where its planes lie.
template <typename IsFull>
Mesh grid_solid(const std::array<std::vector<float>, 3>& cuts, const IsFull& is_full) {
  Mesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> points;
  const auto point = [&](const std::array<int, 3>& at) {
    const auto [known, is_new] = points.emplace(at, static_cast<std::uint32_t>(mesh.points.size()));
    const auto cut = [&](std::size_t k) { return cuts[k][static_cast<std::size_t>(at[k])]; };
    if (is_new) mesh.points.push_back({cut(0), cut(1), cut(2)});
    return known->second;
  };
  const auto cells = [&](std::size_t k) { return static_cast<int>(cuts[k].size()) - 1; };
  const auto full = [&](const std::array<int, 3>& cell) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (cell[k] < 0 || cell[k] >= cells(k)) return false;
    }
    return is_full(cell[0], cell[1], cell[2]);
  };
  for (int x = 0; x < cells(0); ++x) {
    for (int y = 0; y < cells(1); ++y) {
      for (int z = 0; z < cells(2); ++z) {
        const std::array<int, 3> cell = {x, y, z};
        for (std::size_t axis = 0; axis < 3 && full(cell); ++axis) {
          for (const int side : {0, 1}) {
            std::array<int, 3> next = cell;
            next[axis] += side == 0 ? -1 : 1;
            if (full(next)) continue;
            std::array<int, 3> corner[4] = {cell, cell, cell, cell};
            const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
            for (auto& c : corner) c[axis] += side;
            ++corner[1][u], ++corner[2][u], ++corner[2][v], ++corner[3][v];
            if (side == 0) std::swap(corner[1], corner[3]);
            const std::uint32_t p = point(corner[0]), q = point(corner[1]), r = point(corner[2]),
                                s = point(corner[3]);
            mesh.triangles.push_back({p, q, r});
            mesh.triangles.push_back({p, r, s});
          }
        }
      }
    }
  }
  return mesh;
}

/// An angle bracket whose two plates have a hole each.
Mesh bracket() {
  return grid_solid({{{-0.5f, -0.375f, 0, 0.25f, 0.5f}, {-0.4f, -0.1f, 0.15f, 0.4f}, {-0.5f, -0.375f, 0, 0.25f, 0.5f}}},
                    [](int x, int y, int z) {
                      const bool hole = y == 1 && (x == 2 || z == 2);
                      return (x == 0 || z == 0) && !hole;
                    });
}

struct Solid {
  const char* name;
  Mesh mesh;
};

void PrintTo(const Solid& solid, std::ostream* out) {
  *out << solid.name;
}

const std::vector<Solid>& solids() {
  static const std::vector<Solid> all = {{"box", box(1, 0.75f, 0.5f)},
                                         {"tetrahedron", tetrahedron()},
                                         {"sphere", sphere(0.5, 2)},
                                         {"cylinder", regular_prism(24, 0.4, 0.8f)},
                                         {"bracket", bracket()},
                                         {"pipe", pipe(24, 0.3, 0.5, 0.5f)},
                                         {"ring", ring(24, 0.4, 10, 0.15)},
                                         {"cow", project_mesh("cow_1500.obj")}};
  return all;
}

double angle_between(const Vector3& p, const Vector3& q) {
  return std::atan2(norm(cross(p, q)), dot(p, q));
}

class Triangulations : public testing::TestWithParam<Solid> {};

TEST_P(Triangulations, OfOneSolidGiveTheSameManifolds) {
  RandomPoses random(17);
  const bool verbose = std::getenv("VERBOSE") != nullptr;
  const char* only = std::getenv("ONLY");
  for (const Solid& other : solids()) {
    if (only && std::string(only) != other.name) continue;
    Mesh a = GetParam().mesh, b = other.mesh;
    ManifoldScene coarse, fine;
    coarse.add_body(coarse.add_shape(a), kIdentityPose);
    coarse.add_body(coarse.add_shape(b), kIdentityPose);
    const int times = a.triangles.size() > 1000 || b.triangles.size() > 1000 ? 1 : 2;
    for (int i = 0; i < times; ++i) a = subdivided(a), b = subdivided(b);
    fine.add_body(fine.add_shape(a), kIdentityPose);
    fine.add_body(fine.add_shape(b), kIdentityPose);
    coarse.find();
    const AssetView va = coarse.assets.views()[0], vb = coarse.assets.views()[1];
    const double size = std::min(radius_of(va), radius_of(vb)), both = radius_of(va) + radius_of(vb);
    int seen = 0, scenes = 0, other_count = 0, other_depth = 0, other_normal = 0, both_wrong = 0;
    for (int trial = 0; trial < trials(60, 20); ++trial) {
      const Pose pose_a = any_motion(random, 0); Pose pose_b = any_motion(random, both * std::pow(10, random.uniform(-1, -0.2)));
      if (std::getenv("SHALLOW")) {
        const double far = both * 1.1; Vector3 d = rotate(pose_b, {0, 0, 1}); double lo = 0, hi = far;
        const auto at = [&](double t) { Pose p = pose_b; p.translation[0] = pose_b.translation[0] * 0 + t * d.x, p.translation[1] = t * d.y, p.translation[2] = t * d.z; return p; };
        for (int k = 0; k < 30; ++k) {
          const double t = (lo + hi) / 2;
          coarse.posed = {{0, pose_a}, {1, at(t)}};
          EXPECT_EQ(coarse.scene.place(coarse.posed), Status::kOk);
          EXPECT_EQ(coarse.query.find(coarse.scene, {.first_contact_only = true}), Status::kOk);
          (coarse.query.rows().empty() ? hi : lo) = t;
        }
        pose_b = at(lo - size * std::pow(10, random.uniform(-4, -1)));
      }
      coarse.bodies[0].pose = fine.bodies[0].pose = pose_a;
      coarse.bodies[1].pose = fine.bodies[1].pose = pose_b;
      coarse.find(), fine.find();
      if (coarse.manifolds().empty() && fine.manifolds().empty()) continue;
      ++scenes;
      if (coarse.manifolds().size() != fine.manifolds().size()) {
        ++other_count;
        if (verbose) { std::printf("  trial %d count %zu %zu\n", trial, coarse.manifolds().size(), fine.manifolds().size());
        for (auto* s : {&coarse, &fine}) for (auto& m : s->manifolds()) std::printf("     depth %.6f n %.4f %.4f %.4f area %.5f  flags %u  c %.3f %.3f %.3f\n", m.depth, m.normal[0], m.normal[1], m.normal[2], norm(vector_of(m.area_vector)), m.flags, m.centre[0], m.centre[1], m.centre[2]);
        }
        continue;
      }
      for (const Manifold& m : coarse.manifolds()) {
        const Manifold* best = nullptr;
        double least = INFINITY;
        for (const Manifold& n : fine.manifolds()) {
          const double d = norm(vector_of(m.centre) - vector_of(n.centre)) / size + norm(vector_of(m.area_vector) - vector_of(n.area_vector)) / size / size;
          if (d < least) least = d, best = &n;
        }
        ++seen;
        const double angle = angle_between(vector_of(m.normal), vector_of(best->normal)) / kDegree;
        const bool d = !(std::fabs(m.depth - best->depth) <= 0.01 * std::max(m.depth, best->depth) + 1e-6 * size), n = !(angle <= 1);
        other_depth += d;
        other_normal += n;
        both_wrong += d && n;
        if (verbose && (d || n)) std::printf("  trial %d depth %.6f %.6f angle %.2f flags %u %u area %.6f %.6f n %.4f %.4f %.4f  /  %.4f %.4f %.4f\n", trial, m.depth, best->depth, angle, m.flags, best->flags, norm(vector_of(m.area_vector)), norm(vector_of(best->area_vector)), m.normal[0], m.normal[1], m.normal[2], best->normal[0], best->normal[1], best->normal[2]);
      }
    }
    std::printf("%-12s %-12s scenes %3d other count %3d; manifolds  %3d other depth %3d other normal %3d both %3d\n", GetParam().name, other.name, scenes, other_count, seen, other_depth, other_normal, both_wrong);
    std::fflush(stdout);
  }
}

INSTANTIATE_TEST_SUITE_P(Solids, Triangulations, testing::ValuesIn(solids()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace tandem::test
