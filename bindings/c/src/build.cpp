#include <algorithm>
#include <cmath>
#include <new>
#include <vector>

#include "handles.h"
#include "tandem/build/build_asset.h"
#include "tandem/formats/box.h"

using namespace tandem;
using namespace tandem::c;

namespace {

// A mesh as the builder takes it.
struct Source {
  std::vector<build::SourcePart> parts;
  std::vector<std::vector<build::Point>> poses;
  build::TriangleSource triangles;
};

static_assert(sizeof(build::Point) == 3 * sizeof(double) &&
              sizeof(build::TriangleIndices) == 3 * sizeof(uint32_t));

tandem_status read_poses(const tandem_mesh& mesh, Source& source) {
  const std::size_t points = mesh.pose_count * mesh.vertex_count;
  const auto in_range = [](double x) { return std::fabs(x) <= static_cast<double>(kMaxCoordinate); };
  if (!std::all_of(mesh.poses, mesh.poses + 3 * points, in_range)) return TANDEM_OUT_OF_RANGE;
  const auto* const first = reinterpret_cast<const build::Point*>(mesh.poses);
  for (std::size_t i = 0; i < mesh.pose_count; ++i)
    source.poses.emplace_back(first + i * mesh.vertex_count, first + (i + 1) * mesh.vertex_count);
  source.triangles.poses = source.poses;
  return TANDEM_OK;
}

tandem_status read_mesh(const tandem_mesh& given, Source& source) {
  tandem_mesh mesh;
  if (const tandem_status status = read_struct(&given, mesh); status != TANDEM_OK) return status;
  if (mesh.reserved != 0) return TANDEM_BAD_OPTION;
  if (!is_there(mesh.positions, mesh.vertex_count) || !is_there(mesh.triangles, mesh.triangle_count) ||
      !is_there(mesh.parts, mesh.part_count) || !is_there(mesh.poses, mesh.pose_count))
    return TANDEM_NULL_ARGUMENT;
  if (mesh.triangle_count >= kNoIndex) return TANDEM_TOO_MANY_TRIANGLES;
  build::TriangleSource& to = source.triangles;
  to.points = {reinterpret_cast<const build::Point*>(mesh.positions), mesh.vertex_count};
  to.triangles = {reinterpret_cast<const build::TriangleIndices*>(mesh.triangles), mesh.triangle_count};
  if (mesh.faces != nullptr) to.face = {mesh.faces, mesh.triangle_count};
  if (const tandem_status status = read_poses(mesh, source); status != TANDEM_OK) return status;
  uint64_t faces = mesh.triangle_count;
  if (!to.face.empty()) faces = uint64_t{*std::max_element(to.face.begin(), to.face.end())} + 1;
  if (faces >= kNoIndex) return TANDEM_TOO_MANY_TRIANGLES;
  to.face_count = faces;
  uint64_t named = 0;
  for (const tandem_mesh_part& part : std::span(mesh.parts, mesh.part_count)) {
    if (part.face_count >= kNoIndex - named) return TANDEM_BAD_PART;
    source.parts.push_back({part.name != nullptr ? part.name : "", part.path != nullptr ? part.path : "",
                            named, part.face_count});
    named += part.face_count;
  }
  if (source.parts.empty()) return TANDEM_OK;
  // Without `faces`, a face is a triangle.
  if (named < faces || (to.face.empty() && named != faces)) return TANDEM_BAD_PART;
  to.face_count = named;
  to.parts = source.parts;
  return TANDEM_OK;
}

tandem_status read_options(const tandem_build_options* given, tandem_build_options& read,
                           build::BuildOptions& options) {
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  const bool known = read.effort <= TANDEM_EFFORT_BEST && read.no_gpu_blocks <= 1 && read.no_topology <= 1 &&
                     read.no_refit <= 1 && read.imaginary_share >= 0 && read.imaginary_share <= 1;
  if (!known) return TANDEM_BAD_OPTION;
  constexpr build::Effort kEfforts[] = {build::Effort::standard, build::Effort::fast, build::Effort::best};
  options.effort = kEfforts[read.effort];
  options.imaginary.share = read.imaginary_share;
  options.gpu_blocks = read.no_gpu_blocks == 0;
  options.topology = read.no_topology == 0;
  options.refit = read.no_refit == 0;
  options.threads = read.threads;
  return TANDEM_OK;
}

tandem_build_report report_of(const build::CleanReport& clean) {
  tandem_build_report report = {};
  report.index_out_of_range = clean.faces_index_out_of_range;
  report.not_finite = clean.faces_not_finite;
  report.too_large = clean.faces_too_large;
  report.degenerate = clean.triangles_degenerate;
  report.duplicate = clean.triangles_duplicate;
  report.duplicate_reversed = clean.triangles_duplicate_reversed;
  report.flattened = clean.triangles_flattened;
  report.vertices_unreferenced = clean.vertices_unreferenced;
  report.vertices_welded = clean.vertices_welded;
  return report;
}

build::BuiltAsset build_with(const Source& source, const build::BuildOptions& options,
                             const tandem_build_options& read) {
  build::OptimisationWatch watch;
  if (read.progress != nullptr)
    watch.progress = [&](double share) { watch.stop = watch.stop || read.progress(read.user, share) != 0; };
  return build::build_asset(source.triangles, options, read.provenance != nullptr ? read.provenance : "",
                            watch);
}

tandem_status take(build::BuiltAsset built, tandem_asset& made) {
  if (!built.file) return TANDEM_NO_TRIANGLE;
  made.view = built.file->asset;
  made.copy = built.file->image.release();
  return TANDEM_OK;
}

}  // namespace

tandem_status tandem_asset_build(const tandem_mesh* mesh, const tandem_build_options* options,
                                 const tandem_allocator* allocator, tandem_asset** asset,
                                 tandem_build_report* report) {
  return create(allocator, asset, [&](tandem_asset& made) -> tandem_status {
    if (mesh == nullptr) return TANDEM_NULL_ARGUMENT;
    tandem_build_options read;
    build::BuildOptions understood;
    Source source;
    tandem_status status = read_options(options, read, understood);
    if (status == TANDEM_OK) status = read_mesh(*mesh, source);
    if (status == TANDEM_OK && report != nullptr) status = write_struct(tandem_build_report{}, report);
    if (status != TANDEM_OK) return status;
    build::BuiltAsset built = build_with(source, understood, read);
    if (report != nullptr) (void)write_struct(report_of(built.clean), report);
    return take(std::move(built), made);
  });
}
