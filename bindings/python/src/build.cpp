#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <string>
#include <tuple>

#include "core.h"
#include "patience.h"

namespace tandem::python {
namespace {

using Part = std::tuple<std::string, std::string, std::uint64_t>;

// A build whose result nobody wants need not go on to a whole tree, which is what returning 1 asks for. The C
// interface's functions, linked into this module, take what is thrown here for a defect.
std::uint32_t note(void* user, double share) {
  auto& watch = *static_cast<Watch*>(user);
  watch.share = share;
  if (watch.stop) throw Stopped();
  return 0;
}

// Returns the counts in the order of tandem.BuildReport.
nb::tuple to_tuple(const tandem_build_report& of) {
  return nb::make_tuple(of.index_out_of_range, of.not_finite, of.too_large, of.degenerate, of.duplicate,
                        of.duplicate_reversed, of.flattened, of.vertices_unreferenced, of.vertices_welded);
}

// Positions, in `poses` of one pose after the other, and triangles by rows; faces of triangles or None;
// names, paths and counts of faces of parts.
nb::tuple build(nb::handle positions, nb::handle poses, nb::handle triangles, nb::handle faces,
                const std::vector<Part>& parts, std::uint32_t effort, bool gpu_blocks, bool topology,
                bool refit, std::uint32_t threads, double imaginary_share, const nb::object& provenance,
                nb::handle progress) {
  const auto points = copy_rows<double>(positions);
  const auto posed_points = copy_rows<double>(poses);
  const auto corners = copy_rows<std::uint32_t>(triangles);
  std::vector<std::uint32_t> face_of;
  if (!faces.is_none()) face_of = copy_rows<std::uint32_t>(faces);
  std::vector<tandem_mesh_part> mesh_parts;
  for (const auto& [name, path, count] : parts) mesh_parts.push_back({name.c_str(), path.c_str(), count});

  auto mesh = sized<tandem_mesh>();
  mesh.positions = points.data();
  mesh.vertex_count = points.size() / 3;
  mesh.poses = posed_points.data();
  mesh.pose_count = points.empty() ? 0 : posed_points.size() / points.size();
  mesh.triangles = corners.data();
  mesh.triangle_count = corners.size() / 3;
  mesh.faces = faces.is_none() ? nullptr : face_of.data();
  mesh.parts = mesh_parts.data();
  mesh.part_count = mesh_parts.size();

  Watch watch;
  auto options = sized<tandem_build_options>();
  options.effort = effort;
  options.no_gpu_blocks = !gpu_blocks;
  options.no_topology = !topology;
  options.no_refit = !refit;
  options.threads = threads;
  options.imaginary_share = imaginary_share;
  options.provenance = provenance.is_none() ? nullptr : nb::borrow<nb::str>(provenance).c_str();
  options.progress = note;
  options.user = &watch;

  std::unique_ptr<tandem_asset, decltype(&tandem_asset_release)> asset(nullptr, tandem_asset_release);
  auto report = sized<tandem_build_report>();
  tandem_status status = TANDEM_OK;
  run_with_patience(watch, progress, [&] {
    tandem_asset* made = nullptr;
    status = tandem_asset_build(&mesh, &options, nullptr, &made, &report);
    asset.reset(made);
  });
  check(status);
  return nb::make_tuple(nb::cast(Asset(asset.release())), to_tuple(report));
}

}  // namespace

void add_builder(nb::module_& module) {
  module.def("build", build, nb::arg(), nb::arg(), nb::arg(), nb::arg().none(), nb::arg(), nb::arg(),
             nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg().none(), nb::arg().none());
}

}  // namespace tandem::python
