#include "gpu_contact_query.h"
#include "gpu_rows.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_gpu_manifolds : GpuHandle<GpuManifoldQuery> {};

namespace {

tandem_status read_options(const tandem_gpu_manifold_options* given, GpuManifoldOptions& options) {
  tandem_gpu_manifold_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.most_points > kMostManifoldPoints || read.ignore_previous > 1 || read.reserved != 0)
    return TANDEM_BAD_OPTION;
  if (read.most_points != 0) options.most_points = read.most_points;
  options.match_previous = read.ignore_previous == 0;
  return TANDEM_OK;
}

template <typename Call>
tandem_status make(tandem_gpu_manifolds* manifolds, const tandem_gpu_instances* given_instances,
                   const tandem_gpu_pairs* given_pairs, const tandem_gpu_contact_query* query,
                   const tandem_gpu_manifold_options* given_options, tandem_stream stream, const Call& call) {
  return with_assets(manifolds, [&](tandem_gpu_manifolds& self) -> tandem_status {
    if (query == nullptr) return TANDEM_NULL_ARGUMENT;
    GpuInstances instances;
    GpuPairs pairs;
    GpuManifoldOptions options;
    tandem_status status = query->serves(self.assets, false);
    if (status == TANDEM_OK) status = read_options(given_options, options);
    if (status == TANDEM_OK) status = read_instances(given_instances, instances);
    if (status == TANDEM_OK) status = read_pairs(given_pairs, self.given_count.data(), pairs, stream);
    if (status == TANDEM_OK) status = told(call(self.query, instances, pairs, options), self.query);
    return status;
  });
}

}  // namespace

tandem_status tandem_gpu_manifolds_create(const tandem_allocator* allocator,
                                          tandem_gpu_manifolds** manifolds) {
  return create_gpu(allocator, manifolds);
}

void tandem_gpu_manifolds_destroy(tandem_gpu_manifolds* manifolds) {
  delete manifolds;
}

tandem_status tandem_gpu_manifolds_set_assets(tandem_gpu_manifolds* manifolds, tandem_gpu_assets* assets,
                                              tandem_stream stream) {
  return guarded(manifolds, [&](tandem_gpu_manifolds& self) {
    return self.take(
        assets, [&] { return self.query.set_assets(assets->assets.view(), stream); },
        [&] { return self.query.reserve({}); });
  });
}

tandem_status tandem_gpu_manifolds_reserve(tandem_gpu_manifolds* manifolds,
                                           const tandem_gpu_manifold_capacity* capacity) {
  return with_assets(manifolds, [&](tandem_gpu_manifolds& self) -> tandem_status {
    if (capacity == nullptr) return TANDEM_NULL_ARGUMENT;
    if (capacity->reserved != 0) return TANDEM_BAD_OPTION;
    return told(
        self.query.reserve({capacity->pairs, capacity->contacts, capacity->manifolds, capacity->points}),
        self.query);
  });
}

tandem_status tandem_gpu_manifolds_enqueue(tandem_gpu_manifolds* manifolds,
                                           const tandem_gpu_instances* instances,
                                           const tandem_gpu_pairs* pairs,
                                           const tandem_gpu_contact_query* query,
                                           const tandem_gpu_manifold_options* options, tandem_stream stream) {
  return make(manifolds, instances, pairs, query, options, stream,
              [&](auto& self, const auto& bodies, const auto& of, const auto& read) {
                return self.enqueue(bodies, of, query->query, read, stream);
              });
}

tandem_status tandem_gpu_manifolds_find(tandem_gpu_manifolds* manifolds,
                                        const tandem_gpu_instances* instances, const tandem_gpu_pairs* pairs,
                                        const tandem_gpu_contact_query* query,
                                        const tandem_gpu_manifold_options* options, tandem_stream stream) {
  return make(manifolds, instances, pairs, query, options, stream,
              [&](auto& self, const auto& bodies, const auto& of, const auto& read) {
                return self.make(bodies, of, query->query, read, stream);
              });
}

const tandem_manifold* tandem_gpu_manifolds_manifolds(const tandem_gpu_manifolds* manifolds) {
  using Rows = const tandem_manifold*;
  return of_query(manifolds, Rows{},
                  [](const GpuManifoldQuery& of) { return reinterpret_cast<Rows>(of.manifolds()); });
}

const tandem_manifold_point* tandem_gpu_manifolds_points(const tandem_gpu_manifolds* manifolds) {
  using Rows = const tandem_manifold_point*;
  return of_query(manifolds, Rows{},
                  [](const GpuManifoldQuery& of) { return reinterpret_cast<Rows>(of.points()); });
}

const tandem_gpu_manifold_report* tandem_gpu_manifolds_device_report(const tandem_gpu_manifolds* manifolds) {
  using Report = const tandem_gpu_manifold_report*;
  return of_query(manifolds, Report{},
                  [](const GpuManifoldQuery& of) { return reinterpret_cast<Report>(of.device_report()); });
}

tandem_status tandem_gpu_manifolds_get_report(const tandem_gpu_manifolds* manifolds,
                                              tandem_gpu_manifold_report* report) {
  return get_report(manifolds, report);
}

size_t tandem_gpu_manifolds_bytes(const tandem_gpu_manifolds* manifolds) {
  return bytes_of(manifolds);
}
