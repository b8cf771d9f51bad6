#include "arrays.h"

NB_MODULE(_cuda, module) {
  module.doc() =
      "The C interface to a GPU, for the package's Python files, which check what the caller gives.";
  nanobind::set_leak_warnings(false);
  nanobind::module_::import_("tandem._tandem");  // whose assets it takes
  tandem::python::add_arrays(module);
  tandem::python::add_scenes(module);
  tandem::python::add_gpu_queries(module);
}
