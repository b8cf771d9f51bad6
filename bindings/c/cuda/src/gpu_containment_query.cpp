#include "gpu_contact_query.h"
#include "gpu_rows.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_gpu_containment_query : GpuHandle<GpuContainmentQuery> {};

namespace {

template <typename Call>
tandem_status find(tandem_gpu_containment_query* query, const tandem_gpu_instances* given_instances,
                   const tandem_gpu_pairs* given_pairs, const tandem_gpu_contact_query* contacts,
                   tandem_stream stream, const Call& call) {
  return with_assets(query, [&](tandem_gpu_containment_query& self) -> tandem_status {
    if (contacts == nullptr) return TANDEM_NULL_ARGUMENT;
    GpuInstances instances;
    GpuPairs pairs;
    tandem_status status = contacts->serves(self.assets, true);
    if (status == TANDEM_OK) status = read_instances(given_instances, instances);
    if (status == TANDEM_OK) status = read_pairs(given_pairs, self.given_count.data(), pairs, stream);
    if (status == TANDEM_OK) status = told(call(self.query, instances, pairs), self.query);
    return status;
  });
}

}  // namespace

tandem_status tandem_gpu_containment_query_create(const tandem_allocator* allocator,
                                                  tandem_gpu_containment_query** query) {
  return create_gpu(allocator, query);
}

void tandem_gpu_containment_query_destroy(tandem_gpu_containment_query* query) {
  delete query;
}

tandem_status tandem_gpu_containment_query_set_assets(tandem_gpu_containment_query* query,
                                                      tandem_gpu_assets* assets, tandem_stream stream) {
  return guarded(query, [&](tandem_gpu_containment_query& self) {
    return self.take(
        assets, [&] { return self.query.set_assets(assets->assets.view(), stream); },
        [&] { return self.query.reserve({}); });
  });
}

tandem_status tandem_gpu_containment_query_reserve(tandem_gpu_containment_query* query,
                                                   const tandem_gpu_containment_capacity* capacity) {
  return with_assets(query, [&](tandem_gpu_containment_query& self) -> tandem_status {
    if (capacity == nullptr) return TANDEM_NULL_ARGUMENT;
    return told(self.query.reserve({capacity->pairs, capacity->contained}), self.query);
  });
}

tandem_status tandem_gpu_containment_query_enqueue(tandem_gpu_containment_query* query,
                                                   const tandem_gpu_instances* instances,
                                                   const tandem_gpu_pairs* pairs,
                                                   const tandem_gpu_contact_query* contacts,
                                                   tandem_stream stream) {
  return find(query, instances, pairs, contacts, stream, [&](auto& self, const auto& bodies, const auto& of) {
    return self.enqueue(bodies, of, contacts->query, stream);
  });
}

tandem_status tandem_gpu_containment_query_find(tandem_gpu_containment_query* query,
                                                const tandem_gpu_instances* instances,
                                                const tandem_gpu_pairs* pairs,
                                                const tandem_gpu_contact_query* contacts,
                                                tandem_stream stream) {
  return find(query, instances, pairs, contacts, stream, [&](auto& self, const auto& bodies, const auto& of) {
    return self.find(bodies, of, contacts->query, stream);
  });
}

const tandem_containment* tandem_gpu_containment_query_contained(const tandem_gpu_containment_query* query) {
  using Rows = const tandem_containment*;
  return of_query(query, Rows{},
                  [](const GpuContainmentQuery& of) { return reinterpret_cast<Rows>(of.contained()); });
}

const tandem_gpu_containment_report* tandem_gpu_containment_query_device_report(
    const tandem_gpu_containment_query* query) {
  using Report = const tandem_gpu_containment_report*;
  return of_query(query, Report{},
                  [](const GpuContainmentQuery& of) { return reinterpret_cast<Report>(of.device_report()); });
}

tandem_status tandem_gpu_containment_query_get_report(const tandem_gpu_containment_query* query,
                                                      tandem_gpu_containment_report* report) {
  return get_report(query, report);
}

size_t tandem_gpu_containment_query_bytes(const tandem_gpu_containment_query* query) {
  return bytes_of(query);
}
