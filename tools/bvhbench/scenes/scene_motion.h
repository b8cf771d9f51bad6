#pragma once
#include <string>
#include <vector>

namespace tandem::bench {

/// The contents of /simulation of a scene file (docs/scenes.md), which are about its instances: numbers of
/// each, three for a vector; empty where the file is silent.
struct SceneMotion {
  std::vector<double> density, velocity, angular_velocity, centre;
};

/// Reads it from a file that read_scene() accepts. Throws FileError.
SceneMotion read_motion(const std::string& path, std::size_t instances);

class Hdf5Output;

/// Adds it to a scene file in the making. Throws FileError.
void add_motion(Hdf5Output& file, const SceneMotion& motion);

}  // namespace tandem::bench
