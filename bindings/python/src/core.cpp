#include "core.h"

namespace tandem::python {

void check(tandem_status status, std::uint64_t where) {
  if (status == TANDEM_OK) return;
  const nb::object error =
      nb::module_::import_("tandem._errors")
          .attr("from_status")(status, tandem_status_name(status), tandem_status_explain(status),
                               tandem_status_subject(status), where);
  PyErr_SetObject(error.type().ptr(), error.ptr());
  throw nb::python_error();
}

void* bytes_begin(nb::handle bytearray) {
  return PyByteArray_AsString(bytearray.ptr());
}

}  // namespace tandem::python
