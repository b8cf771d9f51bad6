#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "bindings/python/src/patience.h"
#include "bindings/python/src/read_mesh.h"
#include "bvhbuild/import/import.h"
#include "bvhbuild/level_pipeline.h"
#include "bvhbuild/meshing/meshing.h"
#include "common/json.h"
#include "parallel/parallel.h"
#include "tandem/build/build_asset.h"

namespace tandem::build {
namespace {

namespace nb = nanobind;
using Part = std::tuple<std::string, std::string, std::uint64_t>;

using python::copy_rows;

// Returns what python::rows_of() does. own_readers: without assimp, which is run in a child process and needs
// a process with one thread. outside_files: see ReadLimits.
nb::tuple read(const nb::bytes& path, bool own_readers, bool outside_files) {
  ImportOptions options;
  options.limits.outside_files = outside_files;
  options.reader = own_readers ? Reader::tandem : Reader::automatic;
  const std::string name = path.c_str();
  ImportResult imported;
  TriangleMesh triangles;
  {
    const python::WithoutLock other_threads_run;
    imported = import_mesh(name, options);
    CleanReport report;
    if (imported.ok) triangles = triangulate(imported.mesh, report);
  }
  if (!imported.ok) return nb::make_tuple(nb::none(), python::to_bytes(imported.error), false);
  return python::rows_of(imported.mesh, triangles);
}

std::string provenance_of(const Options& options, const Outcome& outcome) {
  Json json = Json::parse(usual_provenance(options, outcome.clean, outcome.interrupted));
  for (const LevelError& error : options.levels) json["options"]["levels"].push_back(name(error));
  return json.dump();
}

// Returns the counts in the order of tandem.BuildReport.
nb::tuple to_tuple(const CleanReport& of) {
  return nb::make_tuple(of.faces_index_out_of_range, of.faces_not_finite, of.faces_too_large,
                        of.triangles_degenerate, of.triangles_duplicate, of.triangles_duplicate_reversed,
                        of.triangles_flattened, of.vertices_unreferenced, of.vertices_welded);
}

// A mesh as the caller has it.
struct Source {
  PolygonMesh polygons;
  std::vector<std::uint32_t> face_of;  ///< of each polygon; empty: its own number
  std::uint64_t face_count = 0;        ///< all parts' together

  TriangleMesh triangles(CleanReport& report) {
    TriangleMesh made = triangulate(polygons, report);
    if (!face_of.empty()) {
      for (std::uint32_t& face : made.face) face = face_of[face];
    }
    return made;
  }
};

Source make_source(nb::handle points, nb::handle corners, nb::handle face_begin, nb::handle face_of,
                   const std::vector<Part>& parts) {
  Source source;
  PolygonMesh& polygons = source.polygons;
  polygons.points = copy_rows<Point>(points);
  polygons.corners = copy_rows<std::uint32_t>(corners);
  polygons.face_begin = copy_rows<std::uint32_t>(face_begin);
  std::uint64_t faces = polygons.face_count();
  if (!face_of.is_none()) {
    source.face_of = copy_rows<std::uint32_t>(face_of);
    faces = 0;
    for (const std::uint32_t face : source.face_of) faces = std::max(faces, std::uint64_t{face} + 1);
  }
  std::uint64_t& named = source.face_count;
  for (const auto& [name, path, count] : parts) {
    if (count >= kNoIndex - named) throw nb::value_error("parts: they have 2^32 - 1 faces or more together");
    polygons.parts.push_back({name, path, named, count});
    named += count;
  }
  if (parts.empty()) polygons.parts.push_back({{}, {}, 0, named = faces});
  if (named >= kNoIndex) throw nb::value_error("face_ids: there are 2^32 - 1 faces or more");
  if (named < faces || (source.face_of.empty() && named != faces))
    throw nb::value_error("parts: their faces are not those of the mesh");
  return source;
}

// The file's bytes and a report; no bytes where no triangle can be used. face_of: of each polygon or None.
nb::tuple build(nb::handle points, nb::handle corners, nb::handle face_begin, nb::handle face_of,
                const std::vector<Part>& parts, std::uint32_t effort, bool gpu_blocks, bool topology,
                bool refit, std::uint32_t threads, double imaginary_share, const std::string& levels,
                const nb::object& provenance, nb::handle progress) {
  Source source = make_source(points, corners, face_begin, face_of, parts);
  Options options;
  constexpr Effort kEfforts[] = {Effort::standard, Effort::fast, Effort::best};
  options.effort = kEfforts[effort];
  options.imaginary.share = imaginary_share;
  options.gpu_blocks = gpu_blocks;
  options.topology = topology;
  options.refit = refit;
  std::string defect = levels.empty() ? "" : parse_level_errors(levels, options.levels);
  if (!defect.empty()) throw nb::value_error(("levels: " + defect).c_str());
  const std::string said = provenance.is_none() ? "" : nb::cast<std::string>(provenance);

  Outcome outcome;
  std::optional<CheckedImage> file;
  python::Watch watch;
  python::run_with_patience(watch, progress, [&] {
    OptimisationWatch optimisation;
    optimisation.progress = [&](double share) {
      watch.share = share;
      if (watch.stop) throw python::Stopped();
    };
    const parallel::ThreadLimit limit(threads);
    TriangleMesh triangles = source.triangles(outcome.clean);
    clean(triangles, outcome.clean);
    const StoredMesh mesh = to_single_precision(triangles, outcome.clean);
    if (mesh.triangles.empty() || !(defect = level_errors_defect(options, mesh)).empty()) return;
    AssetSource about;
    about.source_faces = source.face_count;
    about.source_vertices = outcome.clean.vertices;
    about.parts = source.polygons.parts;
    const auto words = [&] { return said.empty() ? provenance_of(options, outcome) : said; };
    file = build_file(options, mesh, about, words, optimisation, outcome);
  });
  if (!defect.empty()) throw nb::value_error(defect.c_str());
  nb::object bytes = nb::none();
  if (file) bytes = nb::bytes(reinterpret_cast<const char*>(file->image.data()), file->image.size());
  return nb::make_tuple(bytes, to_tuple(outcome.clean));
}

}  // namespace
}  // namespace tandem::build

NB_MODULE(_bvhbuild, module) {
  module.doc() = "Readers of mesh files, polygons and levels of detail, for the package's Python files.";
  nanobind::set_leak_warnings(false);  // daemon threads keep what they have when the interpreter ends
  module.def("read", tandem::build::read);
  const auto none = [] { return nanobind::arg().none(); };
  const auto some = [] { return nanobind::arg(); };
  module.def("build", tandem::build::build, some(), some(), some(), none(), some(), some(), some(), some(),
             some(), some(), some(), some(), none(), none());
}
