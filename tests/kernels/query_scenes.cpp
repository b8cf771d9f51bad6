#include "query_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <utility>

namespace tandem::test {
namespace {

template <class T>
T pick(RandomPoses& random, std::initializer_list<T> values) {
  return values.begin()[random.below(values.size())];
}

float to_stored(double x) {
  return std::clamp(static_cast<float>(std::clamp(x, -3e38, 3e38)), -kMaxCoordinate, kMaxCoordinate);
}

/// 1 to 60, small numbers more often.
std::uint32_t any_count(RandomPoses& random) {
  return 1 + static_cast<std::uint32_t>(random.below(pick<std::uint64_t>(random, {1, 4, 12, 20, 60})));
}

/// Each triangle up to three times, beginning at any corner, turned round or not.
Mesh repeated(RandomPoses& random, const Mesh& mesh) {
  Mesh out;
  for (const auto& triangle : mesh.triangles) {
    const std::uint64_t times = 1 + random.below(3);
    for (std::uint64_t i = 0; i < times; ++i) {
      const std::uint64_t first = random.below(3), step = 1 + random.below(2);
      const auto corner = [&](std::uint64_t k) { return mesh.points[triangle[(first + k * step) % 3]]; };
      out.add(corner(0), corner(1), corner(2));
    }
  }
  return out;
}

/// Segments and points of an integer grid.
Mesh flat_soup(RandomPoses& random, std::uint32_t triangles) {
  Mesh mesh;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    int start[3], step[3];
    for (int k = 0; k < 3; ++k) {
      start[k] = static_cast<int>(random.below(3));
      step[k] = static_cast<int>(random.below(3)) - 1;
    }
    const auto point = [&] {
      const int s = static_cast<int>(random.below(4)) - 1;
      return std::array<float, 3>{static_cast<float>(start[0] + s * step[0]),
                                  static_cast<float>(start[1] + s * step[1]),
                                  static_cast<float>(start[2] + s * step[2])};
    };
    const auto a = point(), b = point();
    mesh.add(a, b, point());
  }
  return mesh;
}

Mesh any_mesh(RandomPoses& random) {
  switch (random.below(5)) {
    case 0:
      return grid_soup(random, any_count(random), 2);
    case 1:
      return flat_soup(random, any_count(random));
    case 2:
      return cube(0.5f, static_cast<int>(1 + random.below(2)));
    case 3:
      return repeated(random, soup(random, 1 + any_count(random) / 3, 1));
    default:
      return soup(random, any_count(random), pick(random, {0.3, 1.0}));
  }
}

void move(Pose& pose, double x, double y, double z) {
  const double by[3] = {x, y, z};
  for (int k = 0; k < 3; ++k) pose.translation[k] += by[k];
}

/// A number of instances of any asset, posed by `make_pose`.
template <class MakePose>
void add_instances(BodyScene& scene, RandomPoses& random, MakePose make_pose) {
  const std::uint64_t count = 2 + random.below(4);
  for (std::uint64_t i = 0; i < count; ++i) {
    scene.instances.push_back({static_cast<std::uint32_t>(random.below(scene.assets.size())), make_pose()});
  }
}

Pose near_origin(RandomPoses& random, double size) {
  Pose pose = any_rotation(random);
  move(pose, random.symmetric(size), random.symmetric(size), random.symmetric(size));
  return pose;
}

Pose on_grid(RandomPoses& random, int size) {
  Pose pose = quarter_turn(random);
  const auto integer = [&] {
    return static_cast<int>(random.below(2 * static_cast<std::uint64_t>(size) + 1)) - size;
  };
  move(pose, integer(), integer(), integer());
  return pose;
}

BodyScene soups(RandomPoses& random) {
  BodyScene scene;
  for (int i = 0; i < 2; ++i)
    scene.assets.add(soup(random, any_count(random), pick(random, {0.2, 0.5, 1.0})));
  add_instances(scene, random, [&] { return near_origin(random, 1.2); });
  return scene;
}

BodyScene grids(RandomPoses& random) {
  BodyScene scene;
  const int size = pick(random, {1, 2, 4});
  for (int i = 0; i < 2; ++i) scene.assets.add(grid_soup(random, any_count(random), size));
  add_instances(scene, random, [&] { return on_grid(random, size); });
  return scene;
}

BodyScene flats(RandomPoses& random) {
  BodyScene scene;
  scene.assets.add(flat_soup(random, any_count(random)));
  scene.assets.add(any_mesh(random));
  const bool turned = random.below(2) == 0;
  add_instances(scene, random, [&] { return turned ? near_origin(random, 1) : on_grid(random, 2); });
  return scene;
}

/// Copies of triangles, and of instances.
BodyScene duplicates(RandomPoses& random) {
  BodyScene scene;
  for (int i = 0; i < 2; ++i) scene.assets.add(repeated(random, any_mesh(random)));
  const Pose pose = near_origin(random, 1);
  add_instances(scene, random, [&] { return random.below(2) == 0 ? pose : near_origin(random, 1); });
  return scene;
}

/// Cubes on a grid that share faces, edges and corners, or overlap by half a side.
BodyScene cubes(RandomPoses& random) {
  BodyScene scene;
  const float side = pick(random, {1.0f, 0.1f, 3.0f});
  scene.assets.add(cube(side / 2, 1));
  scene.assets.add(cube(side / 2, 2));
  const Pose frame = random.below(3) == 0 ? any_rotation(random) : kIdentityPose;
  const bool turned = random.below(2) == 0;
  add_instances(scene, random, [&] {
    const Pose turn = quarter_turn(random);
    Pose pose = frame;
    if (turned) std::copy_n(&turn.rotation[0][0], 9, &pose.rotation[0][0]);
    const auto offset = [&] { return static_cast<double>(side) * pick(random, {-1.0, 0.0, 0.5, 1.0}); };
    const double x = offset(), y = offset(), z = offset();
    apply(frame, x, y, z, pose.translation);
    return pose;
  });
  return scene;
}

BodyScene simple(RandomPoses& random) {
  return pick<BodyScene (*)(RandomPoses&)>(random, {soups, grids, flats, duplicates, cubes})(random);
}

/// So far away that posed vertices coincide, and that coordinates leave the range of expansion arithmetic.
/// There, exact arithmetic is slow, so these meshes are small.
BodyScene very_far_away(RandomPoses& random) {
  BodyScene scene;
  for (int i = 0; i < 2; ++i)
    scene.assets.add(soup(random, 1 + static_cast<std::uint32_t>(random.below(3)), 1));
  add_instances(scene, random, [&] { return near_origin(random, 1); });
  const double far = pick(random, {1e30, 1e52, 1e102, 1e200, 1e299});
  for (Instance& instance : scene.instances) move(instance.pose, far, random.below(2) == 0 ? 0 : far, -far);
  return scene;
}

BodyScene far_away(RandomPoses& random) {
  BodyScene scene = simple(random);
  const double far = pick(random, {1e4, 1e7, 1e7, 1e12, 1e12, 1e12, 1e16, 1e51});
  double by[3];
  for (double& x : by) x = far * pick(random, {-1.0, 0.0, 1.0, 0.7});
  for (Instance& instance : scene.instances) move(instance.pose, by[0], by[1], by[2]);
  return scene;
}

/// Map coordinates: stored relative to an origin.
BodyScene with_origin(RandomPoses& random) {
  BodyScene scene;
  std::array<double, 3> origin[2];
  for (auto& o : origin) {
    o = {pick(random, {0.0, 4.5e6, 1e12, 0.1}), pick(random, {5.2e5, -1e4}), pick(random, {100.3, 0.0})};
    scene.assets.add(any_mesh(random), o);
  }
  const std::uint64_t count = 2 + random.below(3);
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto asset = static_cast<std::uint32_t>(random.below(2));
    Pose pose = random.below(2) == 0 ? near_origin(random, 1) : on_grid(random, 1);
    double moved[3];
    apply({{{pose.rotation[0][0], pose.rotation[0][1], pose.rotation[0][2]},
            {pose.rotation[1][0], pose.rotation[1][1], pose.rotation[1][2]},
            {pose.rotation[2][0], pose.rotation[2][1], pose.rotation[2][2]}},
           {0, 0, 0}},
          origin[asset][0], origin[asset][1], origin[asset][2], moved);
    move(pose, -moved[0], -moved[1], -moved[2]);
    scene.instances.push_back({asset, pose});
  }
  return scene;
}

BodyScene scaled(RandomPoses& random, double factor) {
  BodyScene scene;
  const bool on_a_grid = random.below(2) == 0;
  for (int i = 0; i < 2; ++i) {
    Mesh mesh = on_a_grid ? grid_soup(random, any_count(random), 2) : any_mesh(random);
    scale(mesh, factor);
    scene.assets.add(mesh);
  }
  add_instances(scene, random, [&] {
    Pose pose = on_a_grid ? on_grid(random, 1) : near_origin(random, 1);
    for (double& x : pose.translation) x *= factor;
    return pose;
  });
  return scene;
}

BodyScene huge(RandomPoses& random) {
  return scaled(random,
                pick(random, {0x1p27, 0x1p31, 1e15, 1e25, 0x1p100, 1e36, 1.3e36, 1e37, 1.5e38, 3e38}));
}

BodyScene tiny(RandomPoses& random) {
  return scaled(random, pick(random, {1e-6, 1e-15, 0x1p-80, 0x1p-90, 1e-30, 1e-38, 0x1p-140, 0x1p-149}));
}

/// Assets of every size about one place.
BodyScene mixed_sizes(RandomPoses& random) {
  constexpr double kSizes[] = {1, 1e-40, 1e-20, 1e-8, 1e-3, 1e4, 1e9, 1e20, 1e37, 1.5e38};
  const auto any_size = [&] { return kSizes[random.below(std::size(kSizes))]; };
  BodyScene scene;
  for (int i = 0; i < 4; ++i) {
    Mesh mesh = any_mesh(random);
    scale(mesh, any_size());
    scene.assets.add(mesh);
  }
  add_instances(scene, random, [&] {
    Pose pose = random.below(2) == 0 ? near_origin(random, 1) : on_grid(random, 1);
    const double size = pick(random, {0.0, any_size()});
    for (double& x : pose.translation) x *= size;
    return pose;
  });
  return scene;
}

/// A point of a triangle: a corner, on an edge or within.
std::array<double, 3> point_of(RandomPoses& random, const PosedTriangle& triangle) {
  double weight[3] = {1, 0, 0};
  const std::uint64_t corners = 1 + random.below(3);
  for (std::uint64_t i = 1; i < corners; ++i) {
    weight[i] = random.uniform(0, weight[0]);
    weight[0] -= weight[i];
  }
  std::array<double, 3> point{};
  const std::uint64_t first = random.below(3);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) point[k] += weight[i] * triangle[(first + i) % 3][k];
  }
  return point;
}

/// A point of one instance put on a point of another, up to rounding, or a little off it.
BodyScene touching(RandomPoses& random) {
  BodyScene scene;
  for (int i = 0; i < 2; ++i) scene.assets.add(any_mesh(random));
  const double far = pick(random, {0.0, 0.0, 10.0, 1e4, 1e7});
  scene.instances = {{0, near_origin(random, 1 + far)}, {1, any_rotation(random)}};
  const auto any_triangle = [&](std::uint32_t instance) {
    const auto triangles = posed_triangles(scene, instance);
    return triangles[random.below(triangles.size())];
  };
  const auto p = point_of(random, any_triangle(0)), q = point_of(random, any_triangle(1));
  const double off = pick(random, {0.0, 0.0, 1e-16, 1e-12, 6e-8, 3e-7, 1e-6}) * (1 + far);
  Pose& pose = scene.instances[1].pose;
  move(pose, p[0] - q[0] + random.symmetric(off), p[1] - q[1] + random.symmetric(off),
       p[2] - q[2] + random.symmetric(off));
  return scene;
}

/// Bodies of many small triangles that just touch, or just miss, the plane of one of a few large ones from
/// one side: what the planes of leaves have to tell apart.
BodyScene on_ground(RandomPoses& random) {
  BodyScene scene;
  const double far = pick(random, {0.0, 0.0, 10.0, 1e4, 1e7});
  Mesh ground = soup(random, 1 + static_cast<std::uint32_t>(random.below(9)), 1);
  scale(ground, pick(random, {5.0, 50.0, 1e4}));
  scene.assets.add(ground);
  scene.assets.add(
      soup(random, 17 + static_cast<std::uint32_t>(random.below(40)), pick(random, {0.05, 0.3})));
  scene.instances = {{0, near_origin(random, 1 + far)}, {1, any_rotation(random)}};
  const auto grounds = posed_triangles(scene, 0);
  const PosedTriangle& under = grounds[random.below(grounds.size())];
  double normal[3], length = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    normal[k] = (under[1][i] - under[0][i]) * (under[2][j] - under[0][j]) -
                (under[1][j] - under[0][j]) * (under[2][i] - under[0][i]);
    length += normal[k] * normal[k];
  }
  length = std::sqrt(length) * (random.below(2) == 0 ? 1 : -1);
  std::array<double, 3> lowest{};
  double least = std::numeric_limits<double>::infinity();
  for (const PosedTriangle& triangle : posed_triangles(scene, 1)) {
    for (const auto& corner : triangle) {
      const double height = (corner[0] * normal[0] + corner[1] * normal[1] + corner[2] * normal[2]) / length;
      if (height < least) {
        least = height;
        lowest = corner;
      }
    }
  }
  const auto foot = point_of(random, under);
  const double above = pick(random, {0.0, 1e-16, -1e-16, 6e-8, -6e-8, 1e-6, -1e-6, -0.1}) * (1 + far);
  double by[3];
  for (std::size_t k = 0; k < 3; ++k) by[k] = foot[k] - lowest[k] + above * normal[k] / length;
  move(scene.instances[1].pose, by[0], by[1], by[2]);
  if (random.below(2) == 0) std::swap(scene.instances[0], scene.instances[1]);
  return scene;
}

}  // namespace

int trials(int usual, int factor) {
  return std::getenv("TANDEM_LONG") != nullptr ? usual * factor : usual;
}

void SampleAssets::add(const Mesh& mesh, const std::array<double, 3>& origin, build::Imaginary imaginary) {
  add(mesh, make_file(mesh, imaginary), origin);
}

void SampleAssets::add(const Mesh& mesh, const build::Image& image, const std::array<double, 3>& origin) {
  auto file = std::make_unique<Bytes>(image);
  std::copy(origin.begin(), origin.end(), file->header().origin);
  if (file->check_sealed() != Status::kOk) throw std::logic_error("the sample asset is not sound");
  views_.push_back(file->check().asset);
  files_.push_back(std::move(file));
  meshes_.push_back(mesh);
}

const std::vector<SceneFamily>& scene_families() {
  static const std::vector<SceneFamily> families = {{"soups", soups},
                                                    {"grids", grids},
                                                    {"flats", flats},
                                                    {"duplicates", duplicates},
                                                    {"cubes", cubes},
                                                    {"far_away", far_away},
                                                    {"very_far_away", very_far_away},
                                                    {"with_origin", with_origin},
                                                    {"huge", huge},
                                                    {"tiny", tiny},
                                                    {"mixed_sizes", mixed_sizes},
                                                    {"touching", touching},
                                                    {"on_ground", on_ground}};
  return families;
}

Mesh soup(RandomPoses& random, std::uint32_t triangles, double size) {
  Mesh mesh;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const double centre[3] = {random.symmetric(1), random.symmetric(1), random.symmetric(1)};
    const auto corner = [&] {
      std::array<float, 3> point;
      for (std::size_t k = 0; k < 3; ++k) point[k] = to_stored(centre[k] + random.symmetric(size));
      return point;
    };
    const auto a = corner(), b = corner();
    mesh.add(a, b, corner());
  }
  return mesh;
}

Mesh grid_soup(RandomPoses& random, std::uint32_t triangles, int size) {
  Mesh mesh;
  const auto corner = [&] {
    std::array<float, 3> point;
    for (float& x : point) x = static_cast<float>(random.below(static_cast<std::uint64_t>(size) + 1));
    return point;
  };
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const auto a = corner(), b = corner();
    mesh.add(a, b, corner());
  }
  return mesh;
}

Mesh cube(float half_side, int cells) {
  Mesh mesh;
  for (int face = 0; face < 6; ++face) {
    const auto point = [&](int u, int v) {
      const auto place = [&](int i) {
        return half_side * (2 * static_cast<float>(i) / static_cast<float>(cells) - 1);
      };
      std::array<float, 3> p;
      p[static_cast<std::size_t>(face % 3)] = face < 3 ? half_side : -half_side;
      p[static_cast<std::size_t>((face + 1) % 3)] = place(face < 3 ? u : v);
      p[static_cast<std::size_t>((face + 2) % 3)] = place(face < 3 ? v : u);
      return p;
    };
    for (int u = 0; u < cells; ++u) {
      for (int v = 0; v < cells; ++v) {
        mesh.add(point(u, v), point(u + 1, v), point(u + 1, v + 1));
        mesh.add(point(u, v), point(u + 1, v + 1), point(u, v + 1));
      }
    }
  }
  return mesh;
}

void scale(Mesh& mesh, double factor) {
  for (auto& point : mesh.points) {
    for (float& x : point) x = to_stored(static_cast<double>(x) * factor);
  }
}

Pose quarter_turn(RandomPoses& random) {
  Pose pose{};
  const std::uint64_t first = random.below(3);
  const bool odd = random.below(2) == 0;
  std::uint64_t column[3] = {first, (first + 1) % 3, (first + 2) % 3};
  if (odd) std::swap(column[1], column[2]);
  const double s0 = random.below(2) == 0 ? 1 : -1, s1 = random.below(2) == 0 ? 1 : -1;
  pose.rotation[0][column[0]] = s0;
  pose.rotation[1][column[1]] = s1;
  pose.rotation[2][column[2]] = s0 * s1 * (odd ? -1 : 1);
  return pose;
}

Pose any_rotation(RandomPoses& random) {
  for (;;) {
    Pose pose;
    switch (random.below(6)) {
      case 0:
        pose = kIdentityPose;
        break;
      case 1:
        pose = quarter_turn(random);
        break;
      case 2:
        pose = random.pose({1, 1, 0, 0, pick(random, {1e-15, 1e-9, 1e-7, 1e-4})});
        break;
      case 3:
        pose = random.pose({1, 1, 0, 2.5e-7, pick(random, {0.0, 1e-7, 4.0})});
        break;
      default:
        pose = random.pose({1, 1, 0, 0, 4});
    }
    if (is_rigid(pose)) return pose;
  }
}

double any_distance(RandomPoses& random, const BodyScene& scene) {
  double size = 0;
  for (const AssetView& asset : scene.assets.views()) {
    for (int k = 0; k < 3; ++k)
      size = std::max(size, double{asset.header->upper[k]} - asset.header->lower[k]);
  }
  return pick(random,
              {1.0, 0.5, 0.25, 2.0, size * 0.01, size * 0.1, size * random.uniform(0, 0.5), size * 1e-7});
}

double radius_of(const AssetView& asset) {
  double square = 0;
  for (int k = 0; k < 3; ++k) {
    const double half =
        0.5 * (static_cast<double>(asset.header->upper[k]) - static_cast<double>(asset.header->lower[k]));
    square += half * half;
  }
  return std::sqrt(square);
}

Pose centred_at(const AssetView& asset, Pose pose, const double (&place)[3]) {
  const FileHeader& header = *asset.header;
  double centre[3], moved[3];
  for (int k = 0; k < 3; ++k) {
    centre[k] = header.origin[k] +
                0.5 * (static_cast<double>(header.lower[k]) + static_cast<double>(header.upper[k]));
    pose.translation[k] = 0;
  }
  apply(pose, centre[0], centre[1], centre[2], moved);
  for (int k = 0; k < 3; ++k) pose.translation[k] = place[k] - moved[k];
  return pose;
}

std::ostream& operator<<(std::ostream& out, const FaceContact& contact) {
  return out << '(' << contact.a << ',' << contact.b << ": " << contact.face_a << ',' << contact.face_b
             << ')';
}

FaceContacts found_contacts(const test::Asked<ContactQuery>& query) {
  FaceContacts out;
  for (const Contact& contact : query.rows()) {
    const ObjectPair pair = query.pairs()[contact.pair];
    FaceContact face = {pair.a, pair.b, contact.face_a, contact.face_b};
    if (pair.a > pair.b) face = {pair.b, pair.a, contact.face_b, contact.face_a};
    if (pair.a == pair.b && face.face_a > face.face_b) std::swap(face.face_a, face.face_b);
    out.push_back(face);
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<PosedTriangle> posed_triangles(const BodyScene& scene, std::uint32_t instance) {
  const std::uint32_t asset = scene.instances[instance].asset;
  const Pose& pose = scene.instances[instance].pose;
  const Mesh& mesh = scene.assets.mesh(asset);
  const double* origin = scene.assets.views()[asset].header->origin;
  const auto row = [&](int i, double x, double y, double z) {
    const double* r = pose.rotation[i];
    return (r[0] * x + r[1] * y) + r[2] * z;
  };
  std::vector<PosedTriangle> out;
  for (const auto& triangle : mesh.triangles) {
    PosedTriangle& posed = out.emplace_back();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto& p = mesh.points[triangle[corner]];
      for (int i = 0; i < 3; ++i) {
        const double translation = row(i, origin[0], origin[1], origin[2]) + pose.translation[i];
        posed[corner][static_cast<std::size_t>(i)] = row(i, p[0], p[1], p[2]) + translation;
      }
    }
  }
  return out;
}

TrianglePair pair_of(const PosedTriangle& a, const PosedTriangle& b) {
  TrianglePair pair;
  for (std::size_t i = 0; i < 3; ++i) {
    std::copy_n(a[i].data(), 3, pair.a[i]);
    std::copy_n(b[i].data(), 3, pair.b[i]);
  }
  return pair;
}

FaceContacts all_contacts(const BodyScene& scene, std::uint32_t a, std::uint32_t b) {
  if (a > b) std::swap(a, b);
  const auto of_a = posed_triangles(scene, a), of_b = posed_triangles(scene, b);
  FaceContacts out;
  for (std::uint32_t i = 0; i < of_a.size(); ++i) {
    for (std::uint32_t j = a == b ? i + 1 : 0; j < of_b.size(); ++j) {
      if (decide_exact(pair_of(of_a[i], of_b[j])) == Verdict::contact) out.push_back({a, b, i, j});
    }
  }
  return out;
}

FaceContacts all_contacts(const BodyScene& scene, bool selves) {
  FaceContacts out;
  for (std::uint32_t a = 0; a < scene.instances.size(); ++a) {
    for (std::uint32_t b = selves ? a : a + 1; b < scene.instances.size(); ++b) {
      const FaceContacts more = all_contacts(scene, a, b);
      out.insert(out.end(), more.begin(), more.end());
    }
  }
  return out;
}

std::string text(const BodyScene& scene) {
  std::string out;
  char line[400];
  for (const Instance& instance : scene.instances) {
    const auto& [r, t] = instance.pose;
    std::snprintf(line, sizeof line, "asset %u {{{%a, %a, %a}, {%a, %a, %a}, {%a, %a, %a}}, {%a, %a, %a}}\n",
                  instance.asset, r[0][0], r[0][1], r[0][2], r[1][0], r[1][1], r[1][2], r[2][0], r[2][1],
                  r[2][2], t[0], t[1], t[2]);
    out += line;
  }
  return out;
}

}  // namespace tandem::test
