#include "core.h"

NB_MODULE(_tandem, module) {
  module.doc() = "The C interface for the package's Python files, which check what the caller gives.";
  module.attr("version") = tandem_version();
  tandem::python::add_assets(module);
  tandem::python::add_builder(module);
  tandem::python::add_filters(module);
  tandem::python::add_queries(module);
}
