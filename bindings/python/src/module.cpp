#include "core.h"

NB_MODULE(_tandem, module) {
  module.doc() = "The C interface for the package's Python files, which check what the caller gives.";
  nanobind::set_leak_warnings(false);  // daemon threads keep what they have when the interpreter ends
  module.attr("version") = tandem_version();
  module.attr("NO_TRIANGLE") = tandem_status{TANDEM_NO_TRIANGLE};
  module.def("status_words", [](std::uint32_t status) {
    return nanobind::make_tuple(tandem_status_name(status), tandem_status_explain(status),
                                tandem_status_subject(status));
  });
  tandem::python::add_assets(module);
  tandem::python::add_builder(module);
  tandem::python::add_filters(module);
  tandem::python::add_mujoco(module);
  tandem::python::add_readers(module);
  tandem::python::add_scenes(module);
  tandem::python::add_touches(module);
  tandem::python::add_worlds(module);
}
