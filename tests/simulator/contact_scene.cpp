#include "contact_scene.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "engines/registry.h"

namespace tandem::test {

using Eigen::Isometry3d;
using Eigen::Vector3d;

std::uint32_t ContactScene::add_shape(const Mesh& mesh, const std::array<double, 3>& origin) {
  assets_.add(mesh, origin);
  return assets_.size() - 1;
}

void ContactScene::add_body(std::uint32_t shape, const Isometry3d& pose) {
  bodies_.emplace_back(shape, pose);
}

std::vector<simulation::ContactPoint> ContactScene::points(const Isometry3d& motion) {
  std::vector<Instance> instances;
  for (const auto& [shape, pose] : bodies_) instances.push_back({shape, to_pose(motion * pose)});
  const auto engine = make_engine("tandem");
  engine->set_shapes(assets_.views());
  engine->find(instances, {}, found_);
  simulation::ContactGenerator generator;
  generator.set_shapes(assets_.views());
  const std::vector<simulation::ContactPoint> points = generator.generate(found_, instances, {.threads = threads_});
  statistics_ = generator.statistics();
  return points;
}

Pose to_pose(const Isometry3d& pose) {
  Pose out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.rotation[i][j] = pose.linear()(i, j);
    out.translation[i] = pose.translation()[i];
  }
  return out;
}

Isometry3d at(double x, double y, double z) {
  Isometry3d pose = Isometry3d::Identity();
  pose.translation() = Vector3d(x, y, z);
  return pose;
}

Isometry3d turned(double angle, const Vector3d& axis) {
  return Isometry3d(Eigen::AngleAxisd(angle, axis.normalized()));
}

Isometry3d random_motion(RandomPoses& random, double reach) {
  Eigen::Quaterniond q;
  do {
    for (int k = 0; k < 4; ++k) q.coeffs()[k] = random.symmetric(1);
  } while (q.norm() > 1 || q.norm() < 0.1);
  Isometry3d motion(q.normalized());
  for (int k = 0; k < 3; ++k) motion.translation()[k] = random.symmetric(reach);
  return motion;
}

Mesh sheet(float size, int cells) {
  Mesh mesh;
  const auto point = [&](int i, int j) {
    const auto place = [&](int k) {
      return size * (static_cast<float>(k) / static_cast<float>(cells) - 0.5f);
    };
    return std::array<float, 3>{place(i), place(j), 0};
  };
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      mesh.add(point(i, j), point(i + 1, j), point(i + 1, j + 1));
      mesh.add(point(i, j), point(i + 1, j + 1), point(i, j + 1));
    }
  }
  return mesh;
}

Mesh sphere(double radius, int splits) {
  using Corners = std::array<Vector3d, 3>;
  std::vector<Corners> triangles;
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  for (const int sx : {1, -1}) {
    for (const int sy : {1, -1}) {
      for (const int sz : {1, -1}) {
        const Vector3d p = sx * x, q = sy * y, r = sz * z;
        triangles.push_back(sx * sy * sz > 0 ? Corners{p, q, r} : Corners{p, r, q});
      }
    }
  }
  for (int i = 0; i < splits; ++i) {
    std::vector<Corners> next;
    for (const auto& [p, q, r] : triangles) {
      const Vector3d pq = (p + q).normalized(), qr = (q + r).normalized(), rp = (r + p).normalized();
      next.insert(next.end(), {{p, pq, rp}, {pq, q, qr}, {rp, qr, r}, {pq, qr, rp}});
    }
    triangles.swap(next);
  }
  Mesh mesh;
  const auto corner = [&](const Vector3d& p) {
    return std::array<float, 3>{static_cast<float>(radius * p.x()), static_cast<float>(radius * p.y()),
                                static_cast<float>(radius * p.z())};
  };
  for (const auto& [p, q, r] : triangles) mesh.add(corner(p), corner(q), corner(r));
  return mesh;
}

Mesh box(float x, float y, float z) {
  Mesh mesh = cube(0.5f);
  for (auto& p : mesh.points) p = {p[0] * x, p[1] * y, p[2] * z};
  return mesh;
}

Mesh joined(const Mesh& a, const Mesh& b) {
  Mesh mesh = a;
  const auto base = static_cast<std::uint32_t>(a.points.size());
  mesh.points.insert(mesh.points.end(), b.points.begin(), b.points.end());
  for (const auto& t : b.triangles) mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  return mesh;
}

Mesh moved(Mesh mesh, float x, float y, float z) {
  for (auto& p : mesh.points) p = {p[0] + x, p[1] + y, p[2] + z};
  return mesh;
}

Mesh project_mesh(const char* name) {
  const std::string path = std::string(TANDEM_SOURCE_DIR "/assets/") + name;
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  Mesh mesh;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      auto& p = mesh.points.emplace_back();
      words >> p[0] >> p[1] >> p[2];
    } else if (kind == "f") {
      auto& t = mesh.triangles.emplace_back();
      for (auto& corner : t) words >> corner, --corner;
    }
  }
  return mesh;
}

}  // namespace tandem::test
