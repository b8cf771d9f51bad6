#include "scene_motion.h"

#include <algorithm>
#include <cmath>

#include "hdf5_file.h"

namespace tandem::bench {

SceneMotion read_motion(const std::string& path, std::size_t instances) {
  const Hdf5Input file(path);
  const auto read = [&](const char* name, const Shape& row) -> std::vector<double> {
    if (!file.has(name)) return {};
    std::vector<double> values = file.read_f64(name, row);
    const std::size_t rows = values.size() / (row.empty() ? 1 : row[0]);
    if (rows != instances) {
      throw FileError(path + ": " + name + ": " + std::to_string(rows) + " rows for " +
                      std::to_string(instances) + " instances");
    }
    const bool finite = std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
    if (!finite) throw FileError(path + ": " + name + ": a number is not finite");
    return values;
  };
  SceneMotion motion;
  motion.density = read("/simulation/density", {});
  const auto& density = motion.density;
  if (std::any_of(density.begin(), density.end(), [](double x) { return x <= 0; })) {
    throw FileError(path + ": /simulation/density: a density that is not above 0");
  }
  motion.velocity = read("/simulation/velocity", {3});
  motion.angular_velocity = read("/simulation/angular_velocity", {3});
  motion.centre = read("/simulation/centre", {3});
  return motion;
}

void add_motion(Hdf5Output& file, const SceneMotion& motion) {
  const auto add = [&](const char* name, const std::vector<double>& vectors) {
    if (!vectors.empty()) file.add(name, {vectors.size() / 3, 3}, vectors);
  };
  if (!motion.density.empty()) file.add("/simulation/density", {motion.density.size()}, motion.density);
  add("/simulation/velocity", motion.velocity);
  add("/simulation/angular_velocity", motion.angular_velocity);
  add("/simulation/centre", motion.centre);
}

}  // namespace tandem::bench
