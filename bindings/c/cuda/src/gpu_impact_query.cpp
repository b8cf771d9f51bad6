#include "gpu_handles.h"
#include "gpu_rows.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_gpu_impact_query : GpuHandle<GpuImpactQuery> {};

namespace {

tandem_status read_options(const tandem_gpu_impact_options* given, GpuImpactOptions& options) {
  tandem_gpu_impact_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.sorted > 1 || read.reserved != 0) return TANDEM_BAD_OPTION;
  options.sorted = read.sorted != 0;
  if (read.tolerance != 0) options.tolerance = read.tolerance;
  options.most_blocks = read.most_blocks;
  return read_gpu_filter(read.filter, options.filter);
}

template <typename Call>
tandem_status find(tandem_gpu_impact_query* query, const tandem_gpu_instances* given_instances,
                   const tandem_motion* given_motion, const tandem_gpu_pairs* given_pairs,
                   const tandem_gpu_impact_options* given_options, tandem_stream stream, const Call& call) {
  return with_assets(query, [&](tandem_gpu_impact_query& self) -> tandem_status {
    GpuInstances instances;
    GpuPairs pairs = {};  // none: the query finds them
    GpuImpactOptions options;
    tandem_status status = read_options(given_options, options);
    if (status == TANDEM_OK) status = read_instances(given_instances, instances);
    if (status == TANDEM_OK && !is_there(given_motion, instances.count)) return TANDEM_NULL_ARGUMENT;
    if (status == TANDEM_OK && given_pairs != nullptr)
      status = read_pairs(given_pairs, self.given_count.data(), pairs, stream);
    if (status != TANDEM_OK) return status;
    const auto* const motion = reinterpret_cast<const RigidMotion*>(given_motion);
    return told(call(self.query, instances, motion, pairs, options), self.query);
  });
}

}  // namespace

tandem_status tandem_gpu_impact_query_create(const tandem_allocator* allocator,
                                             tandem_gpu_impact_query** query) {
  return create_gpu(allocator, query);
}

void tandem_gpu_impact_query_destroy(tandem_gpu_impact_query* query) {
  delete query;
}

tandem_status tandem_gpu_impact_query_set_assets(tandem_gpu_impact_query* query, tandem_gpu_assets* assets,
                                                 tandem_stream stream) {
  return guarded(query, [&](tandem_gpu_impact_query& self) {
    return self.take(
        assets, [&] { return self.query.set_assets(assets->assets.view(), stream); },
        [&] { return self.query.reserve({}); });
  });
}

tandem_status tandem_gpu_impact_query_reserve(tandem_gpu_impact_query* query,
                                              const tandem_gpu_impact_capacity* capacity,
                                              const tandem_gpu_impact_options* options) {
  return with_assets(query, [&](tandem_gpu_impact_query& self) -> tandem_status {
    if (capacity == nullptr) return TANDEM_NULL_ARGUMENT;
    if (capacity->reserved != 0) return TANDEM_BAD_OPTION;
    GpuImpactOptions read;
    if (const tandem_status status = read_options(options, read); status != TANDEM_OK) return status;
    return told(
        self.query.reserve({capacity->instances, capacity->pairs, capacity->contacts, capacity->undecided,
                            capacity->parts, capacity->block_pairs, capacity->triangle_pairs},
                           read),
        self.query);
  });
}

tandem_status tandem_gpu_impact_query_enqueue(tandem_gpu_impact_query* query,
                                              const tandem_gpu_instances* instances,
                                              const tandem_motion* motion, double duration,
                                              const tandem_gpu_pairs* pairs,
                                              const tandem_gpu_impact_options* options,
                                              tandem_stream stream) {
  return find(query, instances, motion, pairs, options, stream,
              [&](auto& self, const auto& bodies, auto* moves, const auto& of, const auto& read) {
                return self.enqueue(bodies, moves, duration, of, read, stream);
              });
}

tandem_status tandem_gpu_impact_query_find(tandem_gpu_impact_query* query,
                                           const tandem_gpu_instances* instances, const tandem_motion* motion,
                                           double duration, const tandem_gpu_pairs* pairs,
                                           const tandem_gpu_impact_options* options, tandem_stream stream) {
  return find(query, instances, motion, pairs, options, stream,
              [&](auto& self, const auto& bodies, auto* moves, const auto& of, const auto& read) {
                return self.find(bodies, moves, duration, of, read, stream);
              });
}

tandem_gpu_pairs tandem_gpu_impact_query_pairs(const tandem_gpu_impact_query* query) {
  return of_query(query, tandem_gpu_pairs{}, [](const GpuImpactQuery& of) { return pairs_to_c(of.pairs()); });
}

const tandem_impact* tandem_gpu_impact_query_impacts(const tandem_gpu_impact_query* query) {
  using Rows = const tandem_impact*;
  return of_query(query, Rows{},
                  [](const GpuImpactQuery& of) { return reinterpret_cast<Rows>(of.impacts()); });
}

const tandem_gpu_impact_report* tandem_gpu_impact_query_device_report(const tandem_gpu_impact_query* query) {
  using Report = const tandem_gpu_impact_report*;
  return of_query(query, Report{},
                  [](const GpuImpactQuery& of) { return reinterpret_cast<Report>(of.device_report()); });
}

tandem_status tandem_gpu_impact_query_get_report(const tandem_gpu_impact_query* query,
                                                 tandem_gpu_impact_report* report) {
  return get_report(query, report);
}

size_t tandem_gpu_impact_query_bytes(const tandem_gpu_impact_query* query) {
  return bytes_of(query);
}
