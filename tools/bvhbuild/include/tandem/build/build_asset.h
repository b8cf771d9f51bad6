#pragma once
#include <optional>
#include <span>
#include <string>

#include "tandem/build/build_options.h"
#include "tandem/build/clean_report.h"
#include "tandem/build/image.h"
#include "tandem/build/mesh.h"

/// The builder as a library: triangles in memory become the bytes of a .bvh file, by the same steps as in
/// bvhbuild, without assimp, CGAL or child processes.
namespace tandem::build {

/// Triangles as a program has them. Nothing is asked of them: what cannot be used is left out and counted.
struct TriangleSource {
  std::span<const Point> points;
  std::span<const TriangleIndices> triangles;
  std::span<const std::uint32_t> face;  ///< of each triangle; empty: triangle i is face i
  std::uint64_t face_count = 0;         ///< more than every face; where `face` is empty, of the triangles
  std::span<const SourcePart>
      parts;  ///< ascending, without gaps, together all faces; empty: one without a name
  /// These say where the points are in other samples of an animation; the tree is made for the mean over all
  /// of them. Each has as many rows as `points`, finite and at most kMaxCoordinate in magnitude. At most
  /// kMostTreeSamples samples, the points' own among them, count for the tree, spread evenly.
  std::span<const std::vector<Point>> poses{};
};

struct BuiltAsset {
  std::optional<CheckedImage> file;  ///< none where there is no usable triangle
  CleanReport clean;
};

/// Returns what a file says about how it was made if the caller says nothing: JSON, without anything that
/// depends on the machine. interrupted: the watch ended the optimisation.
std::string usual_provenance(const BuildOptions& options, const CleanReport& report, bool interrupted);

/// Cleans, builds, assembles and checks. The same
/// source, options and provenance give the same bytes whatever their number, and those that bvhbuild
/// writes for a file of these triangles. provenance: JSON; empty: usual_provenance(). The image's memory is
/// that of the allocator in force. Throws std::bad_alloc, and std::logic_error on a defect of the program.
/// Conditions: fewer than 2^32 - 1 triangles; those of TriangleSource.
BuiltAsset build_asset(const TriangleSource& source, const BuildOptions& options, std::string provenance,
                       OptimisationWatch& watch);

}  // namespace tandem::build
