#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bvhbuild/import/import.h"
#include "options.h"

namespace tandem::build {

/// A mesh with its poses in other samples, where some were asked for.
struct SampledImport {
  ImportResult read;               ///< read.mesh.poses are the poses; read.files all other files
  std::vector<std::string> names;  ///< of the samples, for people: "rest", "walk at 1.25 s", "b.obj"
  std::filesystem::path refused;   ///< where not read.ok: the file that the error speaks of
  std::vector<std::filesystem::path> pose_files;
};

/// Reads the mesh that the options name and the samples that they ask for. Must be called while the process
/// has a single thread.
SampledImport import_samples(const Options& options);

}  // namespace tandem::build
