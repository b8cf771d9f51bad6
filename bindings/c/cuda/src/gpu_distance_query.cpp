#include "gpu_handles.h"
#include "gpu_rows.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_gpu_distance_query : GpuHandle<GpuDistanceQuery> {};

namespace {

tandem_status read_options(const tandem_gpu_distance_options* given, GpuDistanceOptions& options) {
  tandem_gpu_distance_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.limit_reach > 1) return TANDEM_BAD_OPTION;
  options.tolerance.absolute = read.absolute_tolerance;
  if (read.relative_tolerance != 0) options.tolerance.relative = read.relative_tolerance;
  if (read.limit_reach != 0) options.reach = read.reach;
  options.former = reinterpret_cast<const ObjectDistance*>(read.former);
  return TANDEM_OK;
}

template <typename Call>
tandem_status find(tandem_gpu_distance_query* query, const tandem_gpu_instances* given_instances,
                   const tandem_gpu_pairs* given_pairs, const tandem_gpu_distance_options* given_options,
                   tandem_stream stream, const Call& call) {
  return with_assets(query, [&](tandem_gpu_distance_query& self) {
    GpuInstances instances;
    GpuPairs pairs;
    GpuDistanceOptions options;
    tandem_status status = read_options(given_options, options);
    if (status == TANDEM_OK) status = read_instances(given_instances, instances);
    if (status == TANDEM_OK) status = read_pairs(given_pairs, self.given_count.data(), pairs, stream);
    if (status == TANDEM_OK) status = told(call(self.query, instances, pairs, options), self.query);
    return status;
  });
}

}  // namespace

tandem_status tandem_gpu_distance_query_create(const tandem_allocator* allocator,
                                               tandem_gpu_distance_query** query) {
  return create_gpu(allocator, query);
}

void tandem_gpu_distance_query_destroy(tandem_gpu_distance_query* query) {
  delete query;
}

tandem_status tandem_gpu_distance_query_set_assets(tandem_gpu_distance_query* query,
                                                   tandem_gpu_assets* assets, tandem_stream stream) {
  return guarded(query, [&](tandem_gpu_distance_query& self) {
    return self.take(
        assets, [&] { return self.query.set_assets(assets->assets.view(), stream); },
        [&] { return self.query.reserve({}); });
  });
}

tandem_status tandem_gpu_distance_query_reserve(tandem_gpu_distance_query* query,
                                                const tandem_gpu_distance_capacity* capacity) {
  return with_assets(query, [&](tandem_gpu_distance_query& self) -> tandem_status {
    if (capacity == nullptr) return TANDEM_NULL_ARGUMENT;
    return told(self.query.reserve({capacity->pairs, capacity->block_pairs, capacity->triangle_pairs,
                                    capacity->settled, capacity->words}),
                self.query);
  });
}

tandem_status tandem_gpu_distance_query_enqueue(tandem_gpu_distance_query* query,
                                                const tandem_gpu_instances* instances,
                                                const tandem_gpu_pairs* pairs,
                                                const tandem_gpu_distance_options* options,
                                                tandem_stream stream) {
  return find(query, instances, pairs, options, stream,
              [&](auto& self, const auto& bodies, const auto& of, const auto& read) {
                return self.enqueue(bodies, of, read, stream);
              });
}

tandem_status tandem_gpu_distance_query_find(tandem_gpu_distance_query* query,
                                             const tandem_gpu_instances* instances,
                                             const tandem_gpu_pairs* pairs,
                                             const tandem_gpu_distance_options* options,
                                             tandem_stream stream) {
  return find(query, instances, pairs, options, stream,
              [&](auto& self, const auto& bodies, const auto& of, const auto& read) {
                return self.find_distances(bodies, of, read, stream);
              });
}

const tandem_distance* tandem_gpu_distance_query_distances(const tandem_gpu_distance_query* query) {
  using Rows = const tandem_distance*;
  return of_query(query, Rows{},
                  [](const GpuDistanceQuery& of) { return reinterpret_cast<Rows>(of.distances()); });
}

const tandem_gpu_distance_report* tandem_gpu_distance_query_device_report(
    const tandem_gpu_distance_query* query) {
  using Report = const tandem_gpu_distance_report*;
  return of_query(query, Report{},
                  [](const GpuDistanceQuery& of) { return reinterpret_cast<Report>(of.device_report()); });
}

tandem_status tandem_gpu_distance_query_get_report(const tandem_gpu_distance_query* query,
                                                   tandem_gpu_distance_report* report) {
  return get_report(query, report);
}

size_t tandem_gpu_distance_query_bytes(const tandem_gpu_distance_query* query) {
  return bytes_of(query);
}
