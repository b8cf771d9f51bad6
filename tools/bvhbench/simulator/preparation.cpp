#include "preparation.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <stdexcept>

#include "bvhbench/scenes/make_scene.h"
#include "bvhbench/scenes/scene_motion.h"
#include "common/random_pose.h"
#include "tandem/formats/hash.h"
#include "tandem/kernels/contact_query.h"

namespace tandem::simulation {
namespace {

// Bodies near the points of a cubic lattice.
class Lattice {
 public:
  Lattice(const AssetView& body, const Bounds& ground, std::uint32_t count, double spacing)
      : bounds_(bounds_of(body)), side_(bench::root_above(count, 3)), spacing_(spacing) {
    const Vector middle = ground.centre();
    const double half = 0.5 * spacing * (side_ - 1);
    // No body reaches further down than half its diagonal.
    first_ = {middle[0] - half, middle[1] - half,
              ground.upper[2] + 0.5 * bounds_.diagonal() + kJitter * spacing};
  }

  Instance draw(std::uint32_t i, Random& random) const {
    const std::uint32_t at[3] = {i % side_, i / side_ % side_, i / side_ / side_};
    Vector position;
    for (int k = 0; k < 3; ++k) {
      position[k] = first_[k] + spacing_ * (at[k] + random.between(-kJitter, kJitter));
    }
    return place(0, random_rotation(random), bounds_.centre(), position);
  }

 private:
  static constexpr double kJitter = 0.1;  // of the spacing

  Bounds bounds_;
  std::uint32_t side_;
  double spacing_;
  Vector first_;
};

// The second body of each pair that touches.
std::vector<std::uint32_t> touching(Scene& scene, const std::vector<Instance>& bodies) {
  ContactQuery query;
  Status status = scene.place(bodies);
  if (status == Status::kOk) status = query.find(scene, {.first_contact_only = true});
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw std::runtime_error(explain(status));
  std::vector<std::uint32_t> found;
  for (const Contact& contact : query.rows()) found.push_back(query.pairs()[contact.pair].b);
  return found;
}

// Draws bodies anew until none touch; false: that did not help.
bool spread(const Lattice& lattice, Scene& scene, Random& random, std::vector<Instance>& bodies) {
  constexpr int kRounds = 60;
  for (std::uint32_t i = 0; i < bodies.size(); ++i) bodies[i] = lattice.draw(i, random);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<std::uint32_t> again = touching(scene, bodies);
    if (again.empty()) return true;
    for (const std::uint32_t i : again) bodies[i] = lattice.draw(i, random);
  }
  return false;
}

using bench::FileError;

// Bodies of each shape, of density 1. Their mass is that of `finest`, the shapes' assets from level 0 on: a
// coarser level changes what a body touches, not what it weighs.
class Shapes {
 public:
  Shapes(std::span<const AssetView> shapes, std::span<const AssetView> finest,
         std::span<const std::string> names)
      : shapes_(shapes),
        finest_(finest),
        names_(names),
        of_dynamic_(shapes.size()),
        of_fixed_(shapes.size()) {}

  BodyProperties body(std::uint32_t shape, Motion motion, double density,
                      std::vector<std::string>& findings) {
    if (motion == Motion::fixed) {
      if (!of_fixed_[shape]) of_fixed_[shape] = fixed(shape);
      return *of_fixed_[shape];
    }
    if (!of_dynamic_[shape]) of_dynamic_[shape] = dynamic(shape, findings);
    BodyProperties body = of_density(*of_dynamic_[shape], density);
    body.motion = motion;
    return body;
  }

 private:
  BodyProperties fixed(std::uint32_t shape) const {
    BodyProperties body;
    body.shape = shape;
    body.motion = Motion::fixed;
    body.radius = radius_about(body.centre, shapes_[shape]);
    return body;
  }

  BodyProperties dynamic(std::uint32_t shape, std::vector<std::string>& findings) const {
    try {
      const MassReport report = mass_properties(finest_[shape]);
      for (const std::string& finding : report.findings) findings.push_back(names_[shape] + ": " + finding);
      BodyProperties body = body_properties(shape, report.properties, 1);
      body.radius = radius_about(body.centre, shapes_[shape]);
      return body;
    } catch (const std::runtime_error& impossible) {
      throw FileError(names_[shape] + ": " + impossible.what());
    }
  }

  std::span<const AssetView> shapes_, finest_;
  std::span<const std::string> names_;
  std::vector<std::optional<BodyProperties>> of_dynamic_, of_fixed_;
};

// A body that sleeps in the file starts awake: a simulation finds out by itself who sleeps.
Motion moved_by(const bench::SceneFilter& filter, std::size_t body) {
  const Motion motion = filter.motion.empty() ? Motion::moving : filter.motion[body];
  return motion == Motion::sleeping ? Motion::moving : motion;
}

void add_body(Preparation& all, const BodyProperties& body, const Pose& pose, const AssetView& shape) {
  all.bodies.push_back(body);
  all.states.push_back(state_of(body, pose));
  if (body.motion == Motion::moving) all.triangles += shape.level().triangle_count;
}

}  // namespace

void Configuration::add(const Instance& instance, Motion moved_by) {
  instances.push_back(instance);
  motion.push_back(moved_by);
}

Configuration structured_stack(const AssetView& box, std::uint32_t side, double jitter, double sink,
                               std::uint64_t seed) {
  const Bounds bounds = bounds_of(box);
  const double length[3] = {bounds.upper[0] - bounds.lower[0], bounds.upper[1] - bounds.lower[1],
                            bounds.upper[2] - bounds.lower[2]};
  Random random(seed);
  Configuration stack;
  for (std::uint32_t layer = 0; layer <= side; ++layer) {
    for (std::uint32_t i = 0; i < side * side; ++i) {
      Instance instance{0, kIdentityPose};
      const std::uint32_t at[2] = {i % side, i / side};
      for (int k = 0; k < 2; ++k) {
        const double moved = layer == 0 ? 0 : random.between(-jitter, jitter);
        instance.pose.translation[k] = length[k] * (at[k] + moved);
      }
      // The floor's upper side is the plane z = 0.
      instance.pose.translation[2] = -bounds.upper[2] + layer * (length[2] - sink);
      stack.add(instance, layer == 0 ? Motion::fixed : Motion::moving);
    }
  }
  return stack;
}

Configuration unstructured_pile(const AssetView& body, const AssetView& ground, std::uint32_t count,
                                std::uint64_t seed) {
  constexpr double kClosest = 0.55, kWider = 1.1;  // of the diagonal, at which no two can touch
  const AssetView assets[] = {body};
  Scene scene;
  if (scene.set_assets(assets) != Status::kOk) throw std::bad_alloc();
  Random random(seed);
  std::vector<Instance> bodies(count);
  double spacing = kClosest * bounds_of(body).diagonal();
  while (!spread(Lattice(body, bounds_of(ground), count, spacing), scene, random, bodies)) spacing *= kWider;
  Configuration pile;
  pile.add({1, kIdentityPose}, Motion::fixed);
  for (const Instance& instance : bodies) pile.add(instance, Motion::moving);
  return pile;
}

Configuration rock_slide(const AssetView& body, const AssetView& ground, std::uint32_t count, double tilt,
                         std::uint64_t seed) {
  Configuration slide;
  for (const Instance& instance : bench::make_slide(body, ground, count, tilt, {seed, {}})) {
    slide.add(instance, instance.asset == 1 ? Motion::fixed : Motion::moving);
  }
  return slide;
}

namespace {

// Refuses what a simulation cannot begin with: poses that no question can be asked about, and given pairs.
void check_scene(const std::string& path, const bench::LoadedScene& scene) {
  if (scene.description.pairs) {
    throw FileError(path + ": /pairs: a simulation finds its pairs by itself; /excluded and " +
                    "/instances/group leave some out");
  }
  Scene bodies;
  Status status = bodies.set_assets(scene.views());
  if (status == Status::kOk) status = bodies.place(scene.description.instances);
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status == Status::kOk) return;
  const char* unit = subject(status);
  const std::string blamed = unit == nullptr ? "" : unit + (" " + std::to_string(bodies.where())) + ": ";
  throw FileError(path + ": " + blamed + explain(status));
}

}  // namespace

Preparation prepare(const Configuration& configuration, std::span<const AssetView> shapes,
                    std::span<const std::string> names, double density) {
  Preparation all;
  Shapes bodies(shapes, shapes, names);
  for (std::size_t i = 0; i < configuration.instances.size(); ++i) {
    const Instance& instance = configuration.instances[i];
    add_body(all, bodies.body(instance.asset, configuration.motion[i], density, all.findings), instance.pose,
             shapes[instance.asset]);
  }
  return all;
}

Preparation prepare_scene(const std::string& path, const bench::LoadedScene& scene, double density) {
  const auto& instances = scene.description.instances;
  check_scene(path, scene);
  const bench::SceneMotion motion = bench::read_motion(path, instances.size());
  const std::vector<AssetView> shapes = scene.views(), finest = scene.finest_views();
  std::vector<std::string> names;
  for (std::size_t i = 0; i < shapes.size(); ++i) names.push_back(scene.name_of(i));
  Preparation all;
  Shapes bodies(shapes, finest, names);
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const std::uint32_t shape = instances[i].asset;
    const Motion mover = moved_by(scene.description.filter, i);
    const double body_density = motion.density.empty() ? density : motion.density[i];
    add_body(all, bodies.body(shape, mover, body_density, all.findings), instances[i].pose, shapes[shape]);
    const auto vector_of = [i](const std::vector<double>& numbers) {
      return numbers.empty() ? Vector3{} : Vector3{numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
    };
    if (mover == Motion::fixed) continue;
    all.states.back().velocity = vector_of(motion.velocity);
    all.states.back().angular_velocity = vector_of(motion.angular_velocity);
  }
  return all;
}

std::uint64_t hash_of(std::span<const BodyProperties> bodies, std::span<const BodyState> states,
                      const bench::LoadedScene& scene) {
  std::vector<double> numbers;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyState& state = states[i];
    numbers.push_back(static_cast<double>(bodies[i].shape));
    numbers.push_back(static_cast<double>(bodies[i].motion));
    numbers.push_back(bodies[i].mass);
    for (const Vector3& vector : {state.position, state.velocity, state.angular_velocity}) {
      numbers.insert(numbers.end(), {vector.x, vector.y, vector.z});
    }
    const Quaternion& turn = state.orientation;
    numbers.insert(numbers.end(), {turn.x, turn.y, turn.z, turn.w});
  }
  std::uint64_t hash = xxh64(numbers.data(), numbers.size() * sizeof(double));
  for (const auto& [asset, level] : scene.shapes) {
    const std::uint64_t mesh = scene.assets[asset].view().header->hash;
    hash = xxh64(&mesh, sizeof mesh, hash);
    if (level > 0) hash = xxh64(&level, sizeof level, hash);
  }
  const bench::SceneFilter& filter = scene.description.filter;
  const auto add = [&hash](std::uint64_t kind, const auto& values) {
    if (!values.empty()) hash = xxh64(values.data(), values.size() * sizeof values[0], hash + kind);
  };
  add(1, filter.group), add(2, filter.mask), add(3, filter.excluded), add(4, filter.world);
  return hash;
}

}  // namespace tandem::simulation
