#include "gpu_handles.h"
#include "gpu_rows.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_gpu_tolerance_query : GpuHandle<GpuToleranceQuery> {};

namespace {

template <typename Call>
tandem_status find(tandem_gpu_tolerance_query* query, const tandem_gpu_instances* given_instances,
                   const tandem_gpu_pairs* given_pairs, tandem_stream stream, const Call& call) {
  return with_assets(query, [&](tandem_gpu_tolerance_query& self) {
    GpuInstances instances;
    GpuPairs pairs;
    tandem_status status = read_instances(given_instances, instances);
    if (status == TANDEM_OK) status = read_pairs(given_pairs, self.given_count.data(), pairs, stream);
    if (status == TANDEM_OK) status = told(call(self.query, instances, pairs), self.query);
    return status;
  });
}

}  // namespace

tandem_status tandem_gpu_tolerance_query_create(const tandem_allocator* allocator,
                                                tandem_gpu_tolerance_query** query) {
  return create_gpu(allocator, query);
}

void tandem_gpu_tolerance_query_destroy(tandem_gpu_tolerance_query* query) {
  delete query;
}

tandem_status tandem_gpu_tolerance_query_set_assets(tandem_gpu_tolerance_query* query,
                                                    tandem_gpu_assets* assets, tandem_stream stream) {
  return guarded(query, [&](tandem_gpu_tolerance_query& self) {
    return self.take(
        assets, [&] { return self.query.set_assets(assets->levels.view(), stream); },
        [&] { return self.query.reserve({}); });
  });
}

tandem_status tandem_gpu_tolerance_query_reserve(tandem_gpu_tolerance_query* query,
                                                 const tandem_gpu_tolerance_capacity* capacity) {
  return with_assets(query, [&](tandem_gpu_tolerance_query& self) -> tandem_status {
    if (capacity == nullptr) return TANDEM_NULL_ARGUMENT;
    return told(self.query.reserve({capacity->instances, capacity->pairs, capacity->undecided}), self.query);
  });
}

tandem_status tandem_gpu_tolerance_query_enqueue(tandem_gpu_tolerance_query* query,
                                                 const tandem_gpu_instances* instances,
                                                 const tandem_gpu_pairs* pairs, double tolerance,
                                                 tandem_stream stream) {
  return find(query, instances, pairs, stream, [&](auto& self, const auto& bodies, const auto& of) {
    return self.enqueue(bodies, of, tolerance, stream);
  });
}

tandem_status tandem_gpu_tolerance_query_find(tandem_gpu_tolerance_query* query,
                                              const tandem_gpu_instances* instances,
                                              const tandem_gpu_pairs* pairs, double tolerance,
                                              tandem_stream stream) {
  return find(query, instances, pairs, stream, [&](auto& self, const auto& bodies, const auto& of) {
    return self.decide(bodies, of, tolerance, stream);
  });
}

const tandem_verdict* tandem_gpu_tolerance_query_verdicts(const tandem_gpu_tolerance_query* query) {
  using Rows = const tandem_verdict*;
  return of_query(query, Rows{},
                  [](const GpuToleranceQuery& of) { return reinterpret_cast<Rows>(of.verdicts()); });
}

const tandem_gpu_tolerance_report* tandem_gpu_tolerance_query_device_report(
    const tandem_gpu_tolerance_query* query) {
  using Report = const tandem_gpu_tolerance_report*;
  return of_query(query, Report{},
                  [](const GpuToleranceQuery& of) { return reinterpret_cast<Report>(of.device_report()); });
}

tandem_status tandem_gpu_tolerance_query_get_report(const tandem_gpu_tolerance_query* query,
                                                    tandem_gpu_tolerance_report* report) {
  return get_report(query, report);
}

size_t tandem_gpu_tolerance_query_bytes(const tandem_gpu_tolerance_query* query) {
  return bytes_of(query);
}
