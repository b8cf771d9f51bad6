#include "solid_meshes.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "query_scenes.h"
#include "tandem/kernels/detail/vector3.h"

namespace tandem::test {
namespace {

using manifold::Vector3;

std::vector<std::array<float, 2>> regular_polygon(int corners, double radius) {
  std::vector<std::array<float, 2>> polygon;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / corners;
    polygon.push_back(
        {static_cast<float>(radius * std::cos(angle)), static_cast<float>(radius * std::sin(angle))});
  }
  return polygon;
}

std::array<float, 3> raised(const std::array<float, 2>& p, float z) {
  return {p[0], p[1], z};
}

void add_square(Mesh& mesh, std::array<float, 3> a, std::array<float, 3> b, std::array<float, 3> c,
                std::array<float, 3> d) {
  mesh.add(a, b, c);
  mesh.add(a, c, d);
}

}  // namespace

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
  using Corners = std::array<Vector3, 3>;
  std::vector<Corners> triangles;
  for (const double x : {1, -1}) {
    for (const double y : {1, -1}) {
      for (const double z : {1, -1}) {
        const Vector3 p = {x, 0, 0}, q = {0, y, 0}, r = {0, 0, z};
        triangles.push_back(x * y * z > 0 ? Corners{p, q, r} : Corners{p, r, q});
      }
    }
  }
  for (int i = 0; i < splits; ++i) {
    std::vector<Corners> next;
    for (const auto& [p, q, r] : triangles) {
      const Vector3 pq = normalized(p + q), qr = normalized(q + r), rp = normalized(r + p);
      next.insert(next.end(), {{p, pq, rp}, {pq, q, qr}, {rp, qr, r}, {pq, qr, rp}});
    }
    triangles.swap(next);
  }
  Mesh mesh;
  const auto corner = [&](const Vector3& p) {
    return std::array<float, 3>{static_cast<float>(radius * p.x), static_cast<float>(radius * p.y),
                                static_cast<float>(radius * p.z)};
  };
  for (const auto& [p, q, r] : triangles) mesh.add(corner(p), corner(q), corner(r));
  return mesh;
}

Mesh box(float x, float y, float z) {
  Mesh mesh = cube(0.5f);
  for (auto& p : mesh.points) p = {p[0] * x, p[1] * y, p[2] * z};
  return mesh;
}

Mesh prism(const std::vector<std::array<float, 2>>& polygon, float height) {
  Mesh mesh;
  const float lower = -height / 2, upper = height / 2;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    add_square(mesh, raised(p, lower), raised(q, lower), raised(q, upper), raised(p, upper));
    if (i == 0 || i + 1 == polygon.size()) continue;
    mesh.add(raised(polygon[0], upper), raised(p, upper), raised(q, upper));
    mesh.add(raised(polygon[0], lower), raised(q, lower), raised(p, lower));
  }
  return mesh;
}

Mesh regular_prism(int corners, double radius, float height) {
  return prism(regular_polygon(corners, radius), height);
}

Mesh wedge() {
  return prism({{-0.5f, -0.125f}, {0.5f, 0}, {-0.5f, 0.125f}}, 0.75f);
}

Mesh tetrahedron() {
  Mesh mesh;
  const std::array<float, 3> a = {0.5f, 0.5f, 0.5f}, b = {0.5f, -0.5f, -0.5f}, c = {-0.5f, 0.5f, -0.5f},
                             d = {-0.5f, -0.5f, 0.5f};
  mesh.add(a, b, c);
  mesh.add(a, d, b);
  mesh.add(a, c, d);
  mesh.add(b, d, c);
  return mesh;
}

Mesh pipe(int corners, double inner_radius, double outer_radius, float height) {
  const auto inner = regular_polygon(corners, inner_radius), outer = regular_polygon(corners, outer_radius);
  Mesh mesh;
  const float lower = -height / 2, upper = height / 2;
  for (std::size_t i = 0; i < inner.size(); ++i) {
    const std::size_t j = (i + 1) % inner.size();
    add_square(mesh, raised(outer[i], lower), raised(outer[j], lower), raised(outer[j], upper),
               raised(outer[i], upper));
    add_square(mesh, raised(inner[j], lower), raised(inner[i], lower), raised(inner[i], upper),
               raised(inner[j], upper));
    add_square(mesh, raised(inner[i], upper), raised(outer[i], upper), raised(outer[j], upper),
               raised(inner[j], upper));
    add_square(mesh, raised(inner[j], lower), raised(outer[j], lower), raised(outer[i], lower),
               raised(inner[i], lower));
  }
  return mesh;
}

Mesh ring(int corners, double radius, int tube_corners, double tube_radius) {
  const auto section = regular_polygon(tube_corners, tube_radius);
  const auto place = [&](int i, int j) -> std::array<float, 3> {
    const auto& p = section[static_cast<std::size_t>(j % tube_corners)];
    const double angle = 2 * 3.14159265358979323846 * (i % corners) / corners, out = radius + p[0];
    return {static_cast<float>(out * std::cos(angle)), static_cast<float>(out * std::sin(angle)), p[1]};
  };
  Mesh mesh;
  for (int i = 0; i < corners; ++i) {
    for (int j = 0; j < tube_corners; ++j)
      add_square(mesh, place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1));
  }
  return mesh;
}

Mesh spring(int corners, int turns, double inner_radius, double outer_radius, double pitch, double height) {
  const double section[4][2] = {
      {inner_radius, 0}, {outer_radius, 0}, {outer_radius, height}, {inner_radius, height}};
  const auto place = [&](int i, int j) -> std::array<float, 3> {
    const auto& p = section[j % 4];
    const double angle = 2 * 3.14159265358979323846 * i / corners;
    return {static_cast<float>(p[0] * std::cos(angle)), static_cast<float>(p[0] * std::sin(angle)),
            static_cast<float>(p[1] + pitch * i / corners)};
  };
  Mesh mesh;
  const int end = corners * turns;
  for (int i = 0; i < end; ++i) {
    for (int j = 0; j < 4; ++j)
      add_square(mesh, place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1));
  }
  add_square(mesh, place(0, 0), place(0, 1), place(0, 2), place(0, 3));
  add_square(mesh, place(end, 0), place(end, 3), place(end, 2), place(end, 1));
  return mesh;
}

Mesh cup(int sectors, float radius, float height, float wall) {
  return revolved(
      {{0, 0}, {radius, 0}, {radius, height}, {radius - wall, height}, {radius - wall, wall}, {0, wall}},
      sectors);
}

Mesh revolved(const std::vector<std::array<float, 2>>& profile, int sectors) {
  Mesh mesh;
  std::vector<std::vector<std::uint32_t>> ring;
  for (const auto& [from_axis, z] : profile) {
    ring.emplace_back();
    if (from_axis == 0) {
      ring.back().push_back(static_cast<std::uint32_t>(mesh.points.size()));
      mesh.points.push_back({0, 0, z});
      continue;
    }
    for (const auto& p : regular_polygon(sectors, from_axis)) {
      ring.back().push_back(static_cast<std::uint32_t>(mesh.points.size()));
      mesh.points.push_back(raised(p, z));
    }
  }
  for (std::size_t k = 0; k + 1 < ring.size(); ++k) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(sectors); ++i) {
      const auto at = [&](std::size_t of, std::size_t n) { return ring[of][n % ring[of].size()]; };
      if (ring[k].size() > 1) mesh.triangles.push_back({at(k, i), at(k, i + 1), at(k + 1, i)});
      if (ring[k + 1].size() > 1) mesh.triangles.push_back({at(k, i + 1), at(k + 1, i + 1), at(k + 1, i)});
    }
  }
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
