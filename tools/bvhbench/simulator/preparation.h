#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "bvhbench/scenes/scene_file.h"
#include "simulator.h"
#include "tandem/formats/view.h"

/// The configurations of the paper's test-bed, as they are before the first step. The same arguments give the
/// same poses on every platform.
namespace tandem::simulation {

/// Bodies and what moves them.
struct Configuration {
  std::vector<Instance> instances;
  std::vector<Motion> motion;  ///< of each instance

  void add(const Instance& instance, Motion moved_by);
};

/// A cube of side^3 boxes, asset 0, on a floor of side^2 fixed ones, which come first. Each box is moved
/// along x and y by up to `jitter` box lengths, and stands in the one below by `sink`, a length.
Configuration structured_stack(const AssetView& box, std::uint32_t side, double jitter, double sink,
                               std::uint64_t seed);

/// `count` bodies, asset 0, at random rotations and places near those of a cubic lattice, above the fixed
/// ground, asset 1, which comes first. No two bodies touch: those that did are turned and moved anew, and
/// where that does not help the lattice is made wider. Throws std::bad_alloc.
Configuration unstructured_pile(const AssetView& body, const AssetView& ground, std::uint32_t count,
                                std::uint64_t seed);

/// make_slide(): bodies strewn on a sheet tilted about the y axis by `tilt` degrees. The fixed sheets, asset
/// 1, come first. Throws std::runtime_error where a sheet is smaller than a body.
Configuration rock_slide(const AssetView& body, const AssetView& ground, std::uint32_t count, double tilt,
                         std::uint64_t seed);

/// Bodies ready to be moved.
struct Preparation {
  std::vector<BodyProperties> bodies;
  std::vector<BodyState> states;
  std::vector<std::string> findings;  ///< what is amiss in meshes and what was done about it
  std::uint64_t triangles = 0;        ///< of the dynamic bodies
};

/// Bodies of the density, at rest where the configuration has them. `names`: of the shapes, for findings.
/// Throws bench::FileError where a dynamic body's mesh has no extent.
Preparation prepare(const Configuration& configuration, std::span<const AssetView> shapes,
                    std::span<const std::string> names, double density);

/// A scene with what /simulation of its file says of the bodies (docs/simulation.md); `density` where it is
/// silent. Masses are those of the finest levels. Throws bench::FileError.
Preparation prepare_scene(const std::string& path, const bench::LoadedScene& scene, double density);

/// Returns what decides a configuration's start: the hash of all instances, of the meshes, and of the scene's
/// coarser levels.
std::uint64_t hash_of(std::span<const BodyProperties> bodies, std::span<const BodyState> states,
                      const bench::LoadedScene& scene);

}  // namespace tandem::simulation
