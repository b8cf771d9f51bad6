#include "scene_motions.h"

#include <algorithm>
#include <optional>

#include "bvhbench/scenes/hdf5_file.h"
#include "bvhbench/scenes/scene_motion.h"
#include "dynamics/mass_properties.h"

namespace tandem::bench {
namespace {

// Centres of mass of the shapes, those of their assets' finest level, computed where they are asked for.
class MassCentres {
 public:
  explicit MassCentres(const LoadedScene& scene) : scene_(scene), centres_(scene.shapes.size()) {}

  // Returns the centre of mass of a shape, in the file's coordinates.
  const dynamics::Vector3& of(std::uint32_t shape) {
    if (!centres_[shape]) centres_[shape] = compute(shape);
    return *centres_[shape];
  }

 private:
  dynamics::Vector3 compute(std::uint32_t shape) const {
    try {
      return dynamics::mass_properties(scene_.assets[scene_.shapes[shape].asset].view()).properties.centre;
    } catch (const std::runtime_error& impossible) {
      throw FileError(scene_.name_of(shape) + ": " + impossible.what());
    }
  }

  const LoadedScene& scene_;
  std::vector<std::optional<dynamics::Vector3>> centres_;
};

}  // namespace

std::vector<RigidMotion> motions_of(const std::string& path, const LoadedScene& scene) {
  const auto& instances = scene.description.instances;
  const auto& movers = scene.description.filter.motion;
  const SceneMotion told = read_motion(path, instances.size());
  MassCentres centres(scene);
  std::vector<RigidMotion> all(instances.size(), kAtRest);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!movers.empty() && movers[i] == Motion::fixed) continue;
    RigidMotion& motion = all[i];
    if (!told.velocity.empty()) std::copy_n(&told.velocity[3 * i], 3, motion.velocity);
    if (!told.angular_velocity.empty())
      std::copy_n(&told.angular_velocity[3 * i], 3, motion.angular_velocity);
    if (!told.centre.empty()) {
      std::copy_n(&told.centre[3 * i], 3, motion.centre);
    } else if (!told.angular_velocity.empty()) {
      const dynamics::Vector3& centre = centres.of(instances[i].asset);
      apply(instances[i].pose, centre.x, centre.y, centre.z, motion.centre);
    }
  }
  return all;
}

}  // namespace tandem::bench
