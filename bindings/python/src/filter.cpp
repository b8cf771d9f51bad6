#include "core.h"

namespace tandem::python {
namespace {

template <typename Value>
const Value* take(nb::handle given, std::vector<Value>& values, std::size_t& count) {
  if (given.is_none()) return nullptr;
  values = copy_rows<Value>(given);
  count = values.size();
  return values.data();
}

}  // namespace

Filter::Filter(nb::object motion, nb::object group, nb::object mask, nb::object world, nb::object excluded) {
  filter_.struct_size = sizeof filter_;
  filter_.motion = take(motion, motion_, filter_.count);
  filter_.group = take(group, group_, filter_.count);
  filter_.mask = take(mask, mask_, filter_.count);
  filter_.world = take(world, world_, filter_.count);
  if (excluded.is_none()) return;
  const auto pairs = copy_rows<tandem_object_pair>(excluded);
  check(tandem_excluded_pairs_create(pairs.data(), pairs.size(), nullptr, &excluded_));
  filter_.excluded = excluded_;
}

void add_filters(nb::module_& module) {
  nb::class_<Filter>(module, "Filter")
      .def(nb::init<nb::object, nb::object, nb::object, nb::object, nb::object>(), nb::arg().none(),
           nb::arg().none(), nb::arg().none(), nb::arg().none(), nb::arg().none());
}

}  // namespace tandem::python
