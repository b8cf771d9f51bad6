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

tandem_level level_of(const Asset& asset, std::uint32_t level) {
  auto result = sized<tandem_level>();
  check(tandem_asset_get_level(asset.get(), level, &result));
  return result;
}

// Returns the fields of tandem._asset.Info in their order.
nb::tuple info(const Asset& asset) {
  auto of = sized<tandem_asset_info>();
  check(tandem_asset_get_info(asset.get(), &of));
  const auto three = [](const auto* v) { return nb::make_tuple(double{v[0]}, double{v[1]}, double{v[2]}); };
  return nb::make_tuple(of.level_count, of.first_level, of.part_count, of.file_bytes, of.hash,
                        of.source_faces, of.source_vertices, three(of.origin), of.rounding_error,
                        three(of.lower), three(of.upper));
}

// Returns the fields of tandem.Level in their order.
nb::tuple level(const Asset& asset, std::uint32_t number) {
  const tandem_level of = level_of(asset, number);
  return nb::make_tuple(of.triangle_count, of.block_count, of.leaf_block_count, of.depth, of.error_bound,
                        of.has_oriented_blocks != 0, of.has_topology != 0, of.vertex_count,
                        of.component_count, of.closed != 0);
}

// Rows of tandem_triangle.
nb::object triangles(const Asset& asset, std::uint32_t number) {
  const tandem_level of = level_of(asset, number);
  return make_bytes(of.triangles, of.triangle_count * sizeof(tandem_triangle));
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
      .def("part", part)
      .def("provenance", provenance)
      .def("statistics", statistics);
  module.def("open", open, nb::rv_policy::take_ownership);
  module.def("from_bytes", from_bytes, nb::rv_policy::take_ownership);
}

}  // namespace tandem::python
