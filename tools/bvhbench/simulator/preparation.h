#pragma once
#include <string>
#include <vector>

#include "bvhbench/scenes/scene_file.h"
#include "configurations.h"
#include "rigid_body.h"

namespace tandem::simulation {

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

/// Penetration that a solver leaves alone unless it is told otherwise: 1/4000 of the first mesh's diagonal.
double default_slop(const AssetView& first);

/// What decides a configuration's start: the hash of all instances, of the meshes, and of the scene's coarser
/// levels.
std::uint64_t hash_of(std::span<const BodyProperties> bodies, std::span<const BodyState> states,
                      const bench::LoadedScene& scene);

}  // namespace tandem::simulation
