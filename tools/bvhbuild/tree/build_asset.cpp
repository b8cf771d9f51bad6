#include "tandem/build/build_asset.h"

#include <charconv>

#include "assemble.h"
#include "bvhbuild/meshing/meshing.h"
#include "parallel/parallel.h"

namespace tandem::build {
namespace {

std::string name(Imaginary imaginary) {
  if (imaginary == Imaginary::minimal) return "minimal";
  if (imaginary == Imaginary::free) return "free";
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, imaginary.share).ptr};
}

const char* name(Effort effort) {
  return effort == Effort::fast ? "fast" : effort == Effort::best ? "best" : "default";
}

}  // namespace

std::string usual_provenance(const BuildOptions& options, const CleanReport& report, bool interrupted) {
  std::string json = R"({"tool":"tandem","version":")" TANDEM_VERSION R"(","input":{"faces":)" +
                     std::to_string(report.faces) + R"(,"vertices":)" + std::to_string(report.vertices) +
                     R"(},"options":{"imaginary":")" + name(options.imaginary) + R"(","effort":")" +
                     name(options.effort) + "\"";
  if (!options.gpu_blocks) json += R"(,"gpu_blocks":false)";
  if (!options.topology) json += R"(,"topology":false)";
  if (!options.refit) json += R"(,"refit":false)";
  if (interrupted) json += R"(,"interrupted":true)";
  json += R"(},"findings":{)";
  bool first = true;
  for (const Finding& finding : findings(report)) {
    if (finding.count == 0) continue;
    json += (first ? "\"" : ",\"") + std::string(finding.key) + "\":" + std::to_string(finding.count);
    first = false;
  }
  return json + "}}";
}

BuiltAsset build_asset(const TriangleSource& given, const BuildOptions& options, std::string provenance,
                       OptimisationWatch& watch) {
  const parallel::ThreadLimit limit(options.threads);
  BuiltAsset built;
  TriangleMesh triangles = take_triangles(given.points, given.triangles, given.face, built.clean);
  triangles.poses.assign(given.poses.begin(), given.poses.end());
  clean(triangles, built.clean);
  const StoredMesh mesh = to_single_precision(triangles, built.clean);
  if (mesh.triangles.empty()) return built;

  AssetSource source;
  source.origin = mesh.origin;
  source.rounding_error = mesh.largest_rounding_error;
  source.source_faces = given.face.empty() ? given.triangles.size() : given.face_count;
  source.source_vertices = given.points.size();
  const SourcePart whole = {{}, {}, 0, source.source_faces};
  source.parts = given.parts.empty() ? std::span(&whole, 1) : given.parts;
  const Geometry geometry{mesh.points, mesh.triangles, mesh.poses};
  const LevelParts parts = build_parts(geometry, options, watch);
  source.provenance =
      provenance.empty() ? usual_provenance(options, built.clean, watch.stop) : std::move(provenance);
  const AssetLevel level = {geometry,
                            mesh.face,
                            &parts.tree,
                            parts.oriented_blocks,
                            0,
                            parts.topology ? &*parts.topology : nullptr,
                            options.refit ? std::span(mesh.source_vertex) : std::span<const std::uint32_t>()};
  built.file = assemble_checked(source, {&level, 1});
  watch.reach(1);
  return built;
}

}  // namespace tandem::build
