#include "arrays.h"

NB_MODULE(_cuda, module) {
  module.doc() =
      "The C interface to a GPU, for the package's Python files, which check what the caller gives.";
  nanobind::set_leak_warnings(false);
  nanobind::module_::import_("tandem._tandem");  // whose assets it takes
  tandem::python::add_arrays(module);
  tandem::python::add_scenes(module);
  tandem::python::add_gpu_queries(module);
  tandem::python::add_gpu_worlds(module);
  // Makes the device that answers a scene's questions on a GPU, as a number; _tandem.Scene takes it.
  module.def("make_device", [](int number) {
    const tandem::python::OnDevice current(tandem::python::require_gpu(number));
    tandem_device* device = nullptr;
    tandem::python::check(tandem_gpu_device_create(nullptr, &device));
    return reinterpret_cast<std::uintptr_t>(device);
  });
}
