#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include "manifold_scene.h"

/// The manifolds of two bodies do not depend on how their surfaces are cut into triangles.
namespace tandem::test {
namespace {

constexpr double kOneDegree = 3.14159265358979323846 / 180;

/// Splits each triangle into four at the middles of its edges. The surface stays where it is, but for
/// float32.
Mesh subdivided(const Mesh& mesh) {
  Mesh out;
  out.points = mesh.points;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t i, std::uint32_t j) {
    const auto [at, is_new] =
        middles.emplace(std::minmax(i, j), static_cast<std::uint32_t>(out.points.size()));
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
  return grid_solid(
      {{{-0.5f, -0.375f, 0, 0.25f, 0.5f}, {-0.4f, -0.1f, 0.15f, 0.4f}, {-0.5f, -0.375f, 0, 0.25f, 0.5f}}},
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

const std::vector<Solid>& cut_solids() {
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

double angle_of(const Vector3& p, const Vector3& q) {
  return std::atan2(norm(cross(p, q)), dot(p, q));
}

/// How many manifolds of one triangulation differ from those of another one.
struct Differences {
  int scenes = 0, other_number = 0, manifolds = 0, other_depth = 0, other_normal = 0;

  void take(std::span<const Manifold> x, std::span<const Manifold> y) {
    ++scenes;
    if (x.size() != y.size()) return ++other_number, void();
    for (const Manifold& m : x) {
      const auto off = [&](const Manifold& n) {
        return norm(vector_of(m.area_vector) - vector_of(n.area_vector)) +
               norm(vector_of(m.centre) - vector_of(n.centre));
      };
      const Manifold& n = *std::min_element(
          y.begin(), y.end(), [&](const Manifold& p, const Manifold& q) { return off(p) < off(q); });
      ++manifolds;
      other_depth += std::fabs(m.depth - n.depth) > 0.01 * std::max(m.depth, n.depth) + 1e-6;
      other_normal += angle_of(vector_of(m.normal), vector_of(n.normal)) > kOneDegree;
    }
  }
};

class Triangulations : public testing::TestWithParam<Solid> {};

TEST_P(Triangulations, OfOneSolidGiveTheSameManifolds) {
  RandomPoses random(17);
  Differences flat, deep;
  for (const Solid& other : cut_solids()) {
    Mesh a = GetParam().mesh, b = other.mesh;
    ManifoldScene coarse, fine;
    coarse.add_body(coarse.add_shape(a), kIdentityPose);
    coarse.add_body(coarse.add_shape(b), kIdentityPose);
    const int times = a.triangles.size() + b.triangles.size() > 1000 ? 1 : 2;
    for (int i = 0; i < times; ++i) a = subdivided(a), b = subdivided(b);
    fine.add_body(fine.add_shape(a), kIdentityPose);
    fine.add_body(fine.add_shape(b), kIdentityPose);
    coarse.find();
    const double radius_a = radius_of(coarse.assets.views()[0]),
                 radius_b = radius_of(coarse.assets.views()[1]);
    for (int trial = 0; trial < trials(60, 20); ++trial) {
      coarse.bodies[0].pose = any_motion(random, 0);
      Pose pose = any_motion(random, (radius_a + radius_b) * std::pow(10, random.uniform(-1, -0.2)));
      if (trial % 2 == 0) {  // else they are deep in each other, mostly
        const Vector3 way = rotate(pose, {0, 0, 1});
        const auto at = [&](double part) {
          return after(shift(part * way.x, part * way.y, part * way.z), pose);
        };
        double apart = 3 * (radius_a + radius_b), meeting = 0;
        for (int i = 0; i < 30; ++i) {
          coarse.bodies[1].pose = at((apart + meeting) / 2);
          coarse.find();
          (coarse.query.rows().empty() ? apart : meeting) = (apart + meeting) / 2;
        }
        pose = at(meeting - std::min(radius_a, radius_b) * std::pow(10, random.uniform(-4, -1)));
      }
      coarse.bodies[1].pose = pose;
      for (int i = 0; i < 2; ++i) fine.bodies[i].pose = coarse.bodies[i].pose;
      coarse.find(), fine.find();
      if (!coarse.query.rows().empty())
        (trial % 2 == 0 ? flat : deep).take(coarse.manifolds(), fine.manifolds());
    }
  }
  for (const auto& [name, found] : {std::pair{"a little", flat}, {"deep", deep}}) {
    std::printf(
        "%s, %s in each other: %d of %d scenes have another number of manifolds, %d of %d manifolds another "
        "depth, %d another normal\n",
        GetParam().name, name, found.other_number, found.scenes, found.other_depth, found.manifolds,
        found.other_normal);
  }
  EXPECT_GT(flat.manifolds, 200);
  EXPECT_GT(deep.manifolds, 150);
  EXPECT_LE(flat.other_number + deep.other_number, 2);
  EXPECT_LE(flat.other_depth, flat.manifolds / 50);
  EXPECT_LE(flat.other_normal, flat.manifolds / 50);
  EXPECT_LE(deep.other_depth, deep.manifolds / 12);
  EXPECT_LE(deep.other_normal, deep.manifolds / 50);
}

INSTANTIATE_TEST_SUITE_P(Solids, Triangulations, testing::ValuesIn(cut_solids()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace tandem::test
