#include "preparation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "bvhbench/scenes/scene_motion.h"
#include "common/random_pose.h"
#include "tandem/formats/hash.h"

namespace tandem::simulation {
namespace {

using bench::FileError;
using Eigen::Vector3d;

// The distance of the farthest vertex.
double radius_about(const Vector3d& center, const AssetView& shape) {
  const LevelView level = shape.level();
  double squared = 0;
  for (const Triangle& triangle : std::span(level.triangles, level.triangle_count)) {
    for (const Triangle::Corner& corner : triangle.corner) {
      Vector3d at;
      for (int k = 0; k < 3; ++k) at[k] = corner.position[k] + shape.header->origin[k];
      squared = std::max(squared, (at - center).squaredNorm());
    }
  }
  return std::sqrt(squared);
}

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
    BodyProperties body = *of_dynamic_[shape];
    body.motion = motion;
    body.mass *= density;
    body.inertia *= density;
    body.inverse_inertia /= density;
    return body;
  }

 private:
  BodyProperties fixed(std::uint32_t shape) const {
    BodyProperties body;
    body.shape = shape;
    body.motion = Motion::fixed;
    body.radius = radius_about(body.center, shapes_[shape]);
    return body;
  }

  BodyProperties dynamic(std::uint32_t shape, std::vector<std::string>& findings) const {
    try {
      const MassReport report = mass_properties(finest_[shape]);
      for (const std::string& finding : report.findings) findings.push_back(names_[shape] + ": " + finding);
      BodyProperties body = body_properties(shape, report.properties, 1);
      body.radius = radius_about(body.center, shapes_[shape]);
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
  const bench::SceneMotion motion = bench::read_motion(path, instances.size());
  const std::vector<AssetView> shapes = scene.views(), finest = scene.finest_views();
  std::vector<std::string> names;
  for (std::size_t i = 0; i < shapes.size(); ++i) names.push_back(scene.name_of(i));
  Preparation all;
  Shapes bodies(shapes, finest, names);
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (!is_rigid(instances[i].pose)) {
      throw FileError(path + ": instance " + std::to_string(i) + ": " + explain(Status::kPoseNotRigid));
    }
    const std::uint32_t shape = instances[i].asset;
    const Motion mover = moved_by(scene.description.filter, i);
    const double body_density = motion.density.empty() ? density : motion.density[i];
    add_body(all, bodies.body(shape, mover, body_density, all.findings), instances[i].pose, shapes[shape]);
    const auto vector_of = [i](const std::vector<double>& numbers) {
      return numbers.empty() ? Vector3d(Vector3d::Zero())
                             : Vector3d(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
    };
    if (mover == Motion::fixed) continue;
    all.states.back().velocity = vector_of(motion.velocity);
    all.states.back().angular_velocity = vector_of(motion.angular_velocity);
  }
  return all;
}

double default_slop(const AssetView& first) {
  return 2.5e-4 * bounds_of(first).diagonal();
}

std::uint64_t hash_of(std::span<const BodyProperties> bodies, std::span<const BodyState> states,
                      const bench::LoadedScene& scene) {
  std::vector<double> numbers;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyState& state = states[i];
    numbers.push_back(static_cast<double>(bodies[i].shape));
    numbers.push_back(static_cast<double>(bodies[i].motion));
    numbers.push_back(bodies[i].mass);
    for (const Vector3d& vector : {state.position, state.velocity, state.angular_velocity}) {
      numbers.insert(numbers.end(), vector.data(), vector.data() + 3);
    }
    numbers.insert(numbers.end(), state.orientation.coeffs().data(), state.orientation.coeffs().data() + 4);
  }
  std::uint64_t hash = xxh64(numbers.data(), numbers.size() * sizeof(double));
  for (const auto& [asset, level] : scene.shapes) {
    const std::uint64_t mesh = scene.assets[asset].view().header->hash;
    hash = xxh64(&mesh, sizeof mesh, hash);
    if (level > 0) hash = xxh64(&level, sizeof level, hash);
  }
  return hash;
}

}  // namespace tandem::simulation
