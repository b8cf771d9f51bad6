#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "kernels/query_scenes.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/world_box.h"

/// Bodies in bodies, and what lies in what by brute force.
namespace tandem::test {

/// Faces of a mesh that are a component.
struct MeshPart {
  std::uint32_t first_face, face_count;
  bool closed;
};

/// A mesh of components that share no edges.
struct PartedMesh {
  Mesh mesh;
  std::vector<MeshPart> parts;

  /// reversed: inside out. open: without its first triangle.
  void add(const Mesh& part, const std::array<float, 3>& offset = {}, bool reversed = false,
           bool open = false) {
    const auto first = static_cast<std::uint32_t>(mesh.triangles.size());
    for (std::size_t t = open ? 1 : 0; t < part.triangles.size(); ++t) {
      std::array<float, 3> p[3];
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t k = 0; k < 3; ++k) p[i][k] = part.points[part.triangles[t][i]][k] + offset[k];
      }
      mesh.add(p[0], p[reversed ? 2 : 1], p[reversed ? 1 : 2]);
    }
    parts.push_back({first, static_cast<std::uint32_t>(mesh.triangles.size()) - first, !open});
  }
};

/// A cube blown up to a ball.
inline Mesh ball(float radius, int cells = 3) {
  Mesh mesh = cube(1, cells);
  for (auto& p : mesh.points) {
    const float length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (float& x : p) x *= radius / length;
  }
  return mesh;
}

struct PartedScene {
  BodyScene scene;
  std::vector<std::vector<MeshPart>> parts;  // of each asset

  void add(const PartedMesh& mesh) {
    scene.assets.add(mesh.mesh);
    parts.push_back(mesh.parts);
  }
  const std::vector<MeshPart>& parts_of(std::uint32_t instance) const {
    return parts[scene.instances[instance].asset];
  }
};

/// The solid angle of a triangle from a point that is not on it (van Oosterom and Strackee 1983).
inline double solid_angle(const PosedTriangle& t, const std::array<double, 3>& p) {
  double d[3][3], length[3], dots[3];
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) d[i][k] = t[i][k] - p[k];
    length[i] = std::hypot(d[i][0], d[i][1], d[i][2]);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    dots[i] = d[i][0] * d[j][0] + d[i][1] * d[j][1] + d[i][2] * d[j][2];
  }
  const double volume = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
                        d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                        d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
  return 2 * std::atan2(volume, length[0] * length[1] * length[2] + dots[0] * length[2] +
                                    dots[1] * length[0] + dots[2] * length[1]);
}

/// Whether closed parts go round the point an odd number of times, by their solid angle.
inline bool is_inside(const std::vector<PosedTriangle>& body, const std::vector<MeshPart>& parts,
                      const std::array<double, 3>& p) {
  bool odd = false;
  for (const MeshPart& part : parts) {
    if (!part.closed) continue;
    double sum = 0;
    for (std::uint32_t t = 0; t < part.face_count; ++t) sum += solid_angle(body[part.first_face + t], p);
    odd = odd != (std::lround(std::fabs(sum) / (4 * std::numbers::pi)) % 2 != 0);
  }
  return odd;
}

/// Returns what find() has to find. The last vertex of each part says where the part is, not the first.
inline std::vector<Containment> all_contained(const PartedScene& parted,
                                              const std::vector<ObjectPair>& pairs) {
  std::vector<Containment> out;
  const BodyScene& scene = parted.scene;
  for (std::uint32_t row = 0; row < pairs.size(); ++row) {
    if (pairs[row].a == pairs[row].b) continue;
    const FaceContacts contacts = all_contacts(scene, pairs[row].a, pairs[row].b);
    for (std::uint32_t inner = 0; inner < 2; ++inner) {
      const std::uint32_t instance = inner == 0 ? pairs[row].a : pairs[row].b,
                          other = inner == 0 ? pairs[row].b : pairs[row].a;
      const auto body = posed_triangles(scene, instance), around = posed_triangles(scene, other);
      const AssetView& outer = scene.assets.views()[scene.instances[other].asset];
      const Pose pose = for_stored_coordinates(scene.instances[other].pose, outer.header->origin);
      const WorldBox box = world_box(pose, outer.header->lower, outer.header->upper);
      const LevelView level = scene.assets.views()[scene.instances[instance].asset].level();
      for (std::uint32_t c = 0; c < level.component_count; ++c) {
        const Triangle& first = level.triangles[level.components[c].first_triangle];
        const std::uint32_t face = first.source_face();
        const auto& parts = parted.parts_of(instance);
        const MeshPart& part = *std::find_if(parts.begin(), parts.end(), [&](const MeshPart& one) {
          return face >= one.first_face && face < one.first_face + one.face_count;
        });
        const bool touched = std::any_of(contacts.begin(), contacts.end(), [&](const FaceContact& contact) {
          const std::uint32_t mine = contact.a == instance ? contact.face_a : contact.face_b;
          return mine >= part.first_face && mine < part.first_face + part.face_count;
        });
        if (touched) continue;
        std::uint32_t flags = 0;
        if (is_inside(around, parted.parts_of(other), body[part.first_face + part.face_count - 1][2]))
          flags |= kInside;
        const Pose own =
            for_stored_coordinates(scene.instances[instance].pose,
                                   scene.assets.views()[scene.instances[instance].asset].header->origin);
        const float* v = first.corner[0].position;
        double p[3];
        apply(own, v[0], v[1], v[2], p);
        bool in_box = true;
        for (int k = 0; k < 3; ++k) in_box = in_box && box.lo[k] <= p[k] && p[k] <= box.hi[k];
        if (in_box && !outer.level().closed) flags |= kOuterOpen;
        if (flags != 0) out.push_back({row, inner, c, flags});
      }
    }
  }
  return out;
}

inline std::vector<ObjectPair> every_pair(const BodyScene& scene, bool selves = false) {
  std::vector<ObjectPair> pairs;
  for (std::uint32_t a = 0; a < scene.instances.size(); ++a) {
    for (std::uint32_t b = selves ? a : a + 1; b < scene.instances.size(); ++b)
      pairs.push_back((a + b) % 3 == 0 ? ObjectPair{b, a} : ObjectPair{a, b});
  }
  return pairs;
}

/// A hull, with a cavity or not, and small components within and without; some inside out, some open.
inline PartedMesh random_parts(RandomPoses& random, bool on_lattice) {
  PartedMesh out;
  const auto flip = [&] { return random.below(3) == 0; };
  const auto open = [&] { return random.below(8) == 0; };
  const auto half = static_cast<float>(2 + random.below(3));
  const auto solid = [&](float size, int cells) { return on_lattice ? cube(size, cells) : ball(size, 2); };
  out.add(solid(half, static_cast<int>(half)), {}, flip(), open());
  if (random.below(2) == 0) out.add(solid(half - 1, 1), {}, flip(), open());
  const std::uint64_t more = random.below(3);
  for (std::uint64_t i = 0; i < more; ++i)
    out.add(solid(0.25f, 1), {half + 1 + static_cast<float>(i), static_cast<float>(i % 2), 0}, flip(),
            open());
  return out;
}

/// Bodies of all sizes about one place. On a lattice, rays meet vertices and run along edges and faces.
inline PartedScene nest(RandomPoses& random, bool on_lattice, double far = 0) {
  PartedScene out;
  for (int i = 0; i < 3; ++i) {
    PartedMesh mesh = i == 2 ? PartedMesh() : random_parts(random, on_lattice);
    if (i == 2)
      mesh.add(on_lattice ? cube(random.below(2) == 0 ? 0.5f : 0.25f, 2) : ball(0.3f), {},
               random.below(2) == 0);
    out.add(mesh);
  }
  const double away[3] = {far * random.symmetric(1), far * random.symmetric(1), far * random.symmetric(1)};
  for (int i = 0; i < 8; ++i) {
    Pose pose = on_lattice ? quarter_turn(random) : any_rotation(random);
    for (int k = 0; k < 3; ++k) {
      pose.translation[k] =
          on_lattice ? 0.5 * (static_cast<double>(random.below(13)) - 6) : random.symmetric(3.5);
      pose.translation[k] += on_lattice ? std::round(away[k]) : away[k];
    }
    out.scene.instances.push_back({static_cast<std::uint32_t>(i < 4 ? 2 : random.below(3)), pose});
  }
  return out;
}

/// Cubes within cubes, and a tetrahedron beside them, under a tree as deep as a file's may be; and small
/// bodies.
inline PartedScene deep_nest(RandomPoses& random) {
  PartedMesh deep;
  const int cells[4] = {7, 3, 2, 1};
  for (int i = 0; i < 4; ++i) deep.add(cube(static_cast<float>(4 - i), cells[i]));
  Mesh tetrahedron;
  const std::array<float, 3> p[4] = {{5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {5, 0, 1}};
  for (std::size_t i = 0; i < 4; ++i) tetrahedron.add(p[i], p[(i + 1) % 4], p[(i + 2) % 4]);
  deep.add(tetrahedron);
  PartedScene out;
  out.scene.assets.add(deep.mesh, make_file(deep.mesh, deepest_tree(deep.mesh)));
  out.parts.push_back(deep.parts);
  PartedMesh small;
  small.add(cube(0.2f));
  out.add(small);
  out.scene.instances.push_back({0, random.pose({1, 1, 0, 0, 4})});
  for (int i = 0; i < 20; ++i) out.scene.instances.push_back({1, random.pose({1, 1, 3, 0, 4})});
  return out;
}

/// Enough bodies about one place for so many pairs.
inline PartedScene crowded_nest(std::uint64_t seed, std::size_t bodies) {
  RandomPoses random(seed);
  PartedScene crowd = nest(random, false);
  while (crowd.scene.instances.size() < bodies) {
    const auto more = nest(random, false).scene.instances;
    crowd.scene.instances.insert(crowd.scene.instances.end(), more.begin(), more.end());
  }
  return crowd;
}

}  // namespace tandem::test
