#include "core.h"

#include <stdexcept>
#include <string>

namespace tandem::python {

void check(tandem_status status, std::uint64_t where) {
  if (status == TANDEM_OK) return;
  throw_status(status, tandem_status_explain(status), tandem_status_subject(status), where);
}

void throw_status(tandem_status status, const char* sentence, const char* subject, std::uint64_t where) {
  const nb::object counted = subject != nullptr ? nb::object(nb::str(subject)) : nb::none();
  const nb::object error =
      nb::module_::import_("tandem._errors")
          .attr("from_status")(status, tandem_status_name(status), sentence, counted, where);
  PyErr_SetObject(error.type().ptr(), error.ptr());
  throw nb::python_error();
}

void throw_vertex(tandem_status status, std::uint32_t asset, std::uint64_t vertex) {
  const std::string sentence =
      std::string(tandem_status_explain(status)) + " (positions of asset " + std::to_string(asset) + ")";
  throw_status(status, sentence.c_str(), "vertex", vertex);
}

void* bytes_begin(nb::handle bytearray) {
  return PyByteArray_AsString(bytearray.ptr());
}

nb::tuple counters_of(const tandem_contact_counters& of) {
  return nb::make_tuple(of.object_pairs, of.block_pairs, of.candidates, of.decided_by_float32,
                        of.decided_by_float64, of.decided_exactly, of.contacts);
}

Turn::Turn(std::atomic<bool>& busy, const char* refused) : busy_(busy) {
  if (busy_.exchange(true)) throw std::runtime_error(refused);
}

}  // namespace tandem::python
