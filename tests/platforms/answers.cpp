// Prints a line for each question about a heap of bodies: how many rows there are, and a hash of their bytes.
// The same files give the same lines on every platform; only times of impact and worlds, which take sines of
// the C library, may differ in the last bits. Usage: answers FILE.bvh...
#include <tandem/tandem.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace {

constexpr std::uint32_t kBodies = 6;

void require(tandem_status status, const char* what) {
  if (status == TANDEM_OK) return;
  std::printf("%s: %s\n", what, tandem_status_explain(status));
  std::exit(1);
}

template <typename Row>
void print(const char* question, const Row* rows, std::size_t count) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(rows);
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (std::size_t i = 0; i < count * sizeof(Row); ++i) hash = (hash ^ bytes[i]) * 1099511628211u;
  std::printf("  %s %llu %016llx\n", question, static_cast<unsigned long long>(count),
              static_cast<unsigned long long>(hash));
}

/// These numbers, from -1 to 1, are the same everywhere.
class Numbers {
 public:
  double operator()() { return static_cast<double>(random_() >> 11) * 0x1p-52 - 1; }

 private:
  std::mt19937_64 random_{36};
};

void turn(tandem_pose& pose, Numbers& numbers) {
  double q[4], square = 0;
  for (double& x : q) {
    x = numbers();
    square += x * x;
  }
  for (double& x : q) x /= std::sqrt(square);
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) pose.rotation[r][c] = rows[r][c];
}

struct Heap {
  double size = 0;  // of a body
  std::vector<tandem_instance> bodies = std::vector<tandem_instance>(kBodies);
  std::vector<tandem_motion> motion = std::vector<tandem_motion>(kBodies);
  std::vector<double> points, directions;
};

Heap heap_of(const tandem_asset* asset) {
  tandem_asset_info info{};
  info.struct_size = sizeof info;
  require(tandem_asset_get_info(asset, &info), "info");
  Heap heap;
  for (int k = 0; k < 3; ++k) heap.size = std::fmax(heap.size, double{info.upper[k]} - double{info.lower[k]});
  Numbers numbers;
  for (std::uint32_t i = 0; i < kBodies; ++i) {
    turn(heap.bodies[i].pose, numbers);
    for (int k = 0; k < 3; ++k) {
      heap.bodies[i].pose.translation[k] = 0.7 * heap.size * numbers();
      heap.motion[i].velocity[k] = 3 * heap.size * numbers();
      heap.motion[i].angular_velocity[k] = numbers();
      heap.motion[i].centre[k] = heap.bodies[i].pose.translation[k];
    }
  }
  for (int i = 0; i < 3 * 500; ++i) {
    heap.points.push_back(heap.size * numbers());
    heap.directions.push_back(numbers());
  }
  return heap;
}

template <typename Options>
Options options() {
  Options given{};
  given.struct_size = sizeof given;
  return given;
}

void ask_pairs(tandem_scene* scene, const Heap& heap) {
  std::size_t count;
  require(tandem_scene_find_contacts(scene, nullptr), "contacts");
  const tandem_contact* contacts = tandem_scene_contacts(scene, &count);
  print("contacts", contacts, count);
  require(tandem_scene_find_manifolds(scene, nullptr), "manifolds");
  const tandem_manifold* manifolds = tandem_scene_manifolds(scene, &count);
  print("manifolds", manifolds, count);
  const tandem_manifold_point* points = tandem_scene_points(scene, &count);
  print("points", points, count);
  require(tandem_scene_find_distances(scene, nullptr), "distances");
  const tandem_distance* distances = tandem_scene_distances(scene, &count);
  print("distances", distances, count);
  auto impacts_within = options<tandem_impact_options>();
  impacts_within.duration = 1;
  impacts_within.tolerance = 1e-3;
  impacts_within.motion = heap.motion.data();
  impacts_within.motion_count = kBodies;
  require(tandem_scene_find_impacts(scene, &impacts_within), "impacts");
  const tandem_impact* impacts = tandem_scene_impacts(scene, &count);
  print("impacts", impacts, count);
}

void ask_probes(tandem_scene* scene, const Heap& heap) {
  std::size_t count;
  auto closest_to = options<tandem_closest_options>();
  closest_to.points = heap.points.data();
  closest_to.point_count = heap.points.size() / 3;
  closest_to.sides = 1;
  require(tandem_scene_find_closest(scene, &closest_to), "closest");
  const tandem_closest_point* closest = tandem_scene_closest(scene, &count);
  print("closest", closest, count);
  auto along = options<tandem_ray_options>();
  along.origins = heap.points.data();
  along.directions = heap.directions.data();
  along.ray_count = heap.points.size() / 3;
  along.hits = TANDEM_ALL_HITS;
  require(tandem_scene_find_rays(scene, &along), "rays");
  const tandem_ray_hit* hits = tandem_scene_rays(scene, &count);
  print("rays", hits, count);
}

void move_world(tandem_asset* asset, const Heap& heap) {
  tandem_world* world = nullptr;
  require(tandem_world_create(nullptr, nullptr, &world), "world");
  require(tandem_world_set_assets(world, &asset, 1), "world");
  if (tandem_world_set_bodies(world, heap.bodies.data(), kBodies, nullptr, nullptr) == TANDEM_OK) {
    require(tandem_world_step(world, 1.0 / 60, 20), "step");
    std::size_t count;
    const tandem_body_motion* bodies = tandem_world_bodies(world, &count);
    print("world", bodies, count);
  }
  tandem_world_destroy(world);
}

void ask(const char* path) {
  tandem_asset* asset = nullptr;
  tandem_scene* scene = nullptr;
  require(tandem_asset_open(path, nullptr, nullptr, &asset, nullptr), path);
  const Heap heap = heap_of(asset);
  require(tandem_scene_create(nullptr, &scene), "scene");
  require(tandem_scene_set_assets(scene, &asset, 1), "assets");
  require(tandem_scene_place(scene, heap.bodies.data(), kBodies, nullptr), "place");
  ask_pairs(scene, heap);
  ask_probes(scene, heap);
  move_world(asset, heap);
  tandem_scene_destroy(scene);
  tandem_asset_release(asset);
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    std::printf("%s\n", argv[i]);
    ask(argv[i]);
  }
}
