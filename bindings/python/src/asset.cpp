#include <nanobind/stl/string.h>

#include "core.h"

namespace tandem::python {
namespace {

// A null pointer to the bytes of an empty buffer would be a null argument.
const void* there(const void* data) {
  return data != nullptr ? data : "";
}

Asset* open(const nb::bytes& path, bool read, bool quick) {
  auto options = sized<tandem_open_options>();
  options.access = read ? TANDEM_ACCESS_READ : TANDEM_ACCESS_MAP;
  options.check_depth = quick ? TANDEM_CHECK_QUICK : TANDEM_CHECK_FULL;
  tandem_asset* asset = nullptr;
  std::uint64_t where = 0;
  const tandem_status status = [&] {
    const WithoutLock other_threads_run;
    return tandem_asset_open(path.c_str(), &options, nullptr, &asset, &where);
  }();
  check(status, where);
  return new Asset(asset);
}

Asset* from_bytes(nb::handle data, bool quick) {
  const Bytes bytes(data);
  auto options = sized<tandem_memory_options>();
  options.check_depth = quick ? TANDEM_CHECK_QUICK : TANDEM_CHECK_FULL;
  tandem_asset* asset = nullptr;
  std::uint64_t where = 0;
  const tandem_status status = [&] {
    const WithoutLock other_threads_run;
    return tandem_asset_from_memory(there(bytes.data()), bytes.size(), &options, nullptr, &asset, &where);
  }();
  check(status, where);
  return new Asset(asset);
}

Asset* levels_from(const Asset& asset, std::uint32_t first, std::uint32_t count) {
  tandem_asset* levels = nullptr;
  check(tandem_asset_levels_from(asset.get(), first, count, &levels));
  return new Asset(levels);
}

tandem_asset_info info_of(const Asset& asset) {
  auto info = sized<tandem_asset_info>();
  check(tandem_asset_get_info(asset.get(), &info));
  return info;
}

tandem_level level_of(const Asset& asset, std::uint32_t level) {
  auto result = sized<tandem_level>();
  check(tandem_asset_get_level(asset.get(), level, &result));
  return result;
}

template <typename Value>
nb::tuple three(const Value* v) {
  return nb::make_tuple(double{v[0]}, double{v[1]}, double{v[2]});
}

nb::dict info(const Asset& asset) {
  const tandem_asset_info of = info_of(asset);
  nb::dict result;
  result["level_count"] = of.level_count;
  result["first_level"] = of.first_level;
  result["part_count"] = of.part_count;
  result["file_bytes"] = of.file_bytes;
  result["hash"] = of.hash;
  result["source_faces"] = of.source_faces;
  result["origin"] = three(of.origin);
  result["rounding_error"] = of.rounding_error;
  result["lower"] = three(of.lower);
  result["upper"] = three(of.upper);
  return result;
}

// In the order of tandem.Level.
nb::tuple level(const Asset& asset, std::uint32_t number) {
  const tandem_level of = level_of(asset, number);
  return nb::make_tuple(of.triangle_count, of.block_count, of.leaf_block_count, of.depth, of.error_bound,
                        of.has_oriented_blocks != 0, of.has_topology != 0, of.vertex_count,
                        of.component_count, of.closed != 0);
}

// float64 corners in the mesh file's coordinates, three triples for each triangle.
nb::object triangles(const Asset& asset, std::uint32_t number) {
  const tandem_level of = level_of(asset, number);
  const tandem_asset_info about = info_of(asset);
  const std::size_t count = of.triangle_count;
  nb::object bytes = make_bytes(nullptr, count * 9 * sizeof(double));
  double* to = static_cast<double*>(bytes_begin(bytes));
  for (const tandem_triangle& triangle : std::span(of.triangles, count)) {
    for (const tandem_corner& corner : triangle.corner) {
      for (int k = 0; k < 3; ++k) *to++ = double{corner.position[k]} + about.origin[k];
    }
  }
  return bytes;
}

// uint32: word 0 of each triangle is the face of the mesh file, word 1 the part.
nb::object words(const Asset& asset, std::uint32_t number, std::uint32_t corner) {
  const tandem_level of = level_of(asset, number);
  nb::object bytes = make_bytes(nullptr, of.triangle_count * sizeof(std::uint32_t));
  auto* to = static_cast<std::uint32_t*>(bytes_begin(bytes));
  for (const tandem_triangle& triangle : std::span(of.triangles, of.triangle_count))
    *to++ = triangle.corner[corner].w;
  return bytes;
}

nb::tuple part(const Asset& asset, std::uint32_t number) {
  auto of = sized<tandem_part>();
  check(tandem_asset_get_part(asset.get(), number, &of));
  return nb::make_tuple(nb::bytes(of.name, of.name_bytes), nb::bytes(of.path, of.path_bytes), of.first_face,
                        of.face_count);
}

nb::bytes provenance(const Asset& asset) {
  std::size_t size;
  const char* json = tandem_asset_provenance(asset.get(), &size);
  return nb::bytes(json, size);
}

// The bytes of the file, which live as long as the asset, to be read alone.
int get_buffer(PyObject* self, Py_buffer* view, int flags) {
  if (!nb::inst_ready(self)) {  // of Asset.__new__()
    view->obj = nullptr;
    PyErr_SetString(PyExc_BufferError, "the asset was never made");
    return -1;
  }
  std::size_t size;
  const void* data = tandem_asset_data(nb::inst_ptr<Asset>(self)->get(), &size);
  return PyBuffer_FillInfo(view, self, const_cast<void*>(data), static_cast<Py_ssize_t>(size), 1, flags);
}

PyType_Slot asset_slots[] = {{Py_bf_getbuffer, reinterpret_cast<void*>(get_buffer)}, {0, nullptr}};

}  // namespace

void add_assets(nb::module_& module) {
  nb::class_<Asset>(module, "Asset", nb::type_slots(asset_slots))
      .def("levels_from", levels_from)
      .def("coarsest_level",
           [](const Asset& asset, double tolerance) {
             return tandem_asset_coarsest_level(asset.get(), tolerance);
           })
      .def("info", info)
      .def("level", level)
      .def("triangles", triangles)
      .def("words", words)
      .def("part", part)
      .def("provenance", provenance)
      .def("statistics", statistics);
  module.def("open", open, nb::rv_policy::take_ownership);
  module.def("from_bytes", from_bytes, nb::rv_policy::take_ownership);
}

}  // namespace tandem::python
