#include "gpu_handles.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_gpu_broad_phase : GpuHandle<GpuBroadPhase> {};

namespace {

tandem_status read_options(const tandem_gpu_broad_phase_options* given, GpuBroadPhaseOptions& options) {
  tandem_gpu_broad_phase_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.sorted > 1) return TANDEM_BAD_OPTION;
  options.sorted = read.sorted != 0;
  options.within = read.within;
  return read_gpu_filter(read.filter, options.filter);
}

// A call that finds pairs of instances.
template <typename Call>
tandem_status find(tandem_gpu_broad_phase* broad_phase, const tandem_gpu_instances* given,
                   const tandem_gpu_broad_phase_options* given_options, const Call& call) {
  return with_assets(broad_phase, [&](tandem_gpu_broad_phase& self) {
    GpuInstances instances;
    GpuBroadPhaseOptions options;
    tandem_status status = read_instances(given, instances);
    if (status == TANDEM_OK) status = read_options(given_options, options);
    return status == TANDEM_OK ? told(call(self, instances, options), self.query) : status;
  });
}

}  // namespace

TANDEM_GPU_HANDLE(tandem_gpu_broad_phase, tandem_gpu_broad_phase_report)

tandem_status tandem_gpu_broad_phase_set_assets(tandem_gpu_broad_phase* broad_phase,
                                                tandem_gpu_assets* assets) {
  return take_assets(broad_phase, assets, [](GpuBroadPhase& query) {
    query = GpuBroadPhase();  // which forgets what it kept
    return Status::kOk;
  });
}

tandem_status tandem_gpu_broad_phase_reserve(tandem_gpu_broad_phase* broad_phase,
                                             const tandem_gpu_broad_phase_capacity* capacity,
                                             const tandem_gpu_broad_phase_options* options) {
  return reserve(broad_phase, capacity, [&](tandem_gpu_broad_phase& self) {
    GpuBroadPhaseOptions read;
    if (const tandem_status status = read_options(options, read); status != TANDEM_OK) return status;
    return told(self.query.reserve({capacity->instances, capacity->pairs, capacity->instances}, read),
                self.query);
  });
}

tandem_status tandem_gpu_broad_phase_keep_fixed(tandem_gpu_broad_phase* broad_phase,
                                                const tandem_gpu_instances* instances, const uint8_t* motion,
                                                const uint32_t* world, tandem_stream stream) {
  return with_assets(broad_phase, [&](tandem_gpu_broad_phase& self) -> tandem_status {
    GpuInstances read;
    if (const tandem_status status = read_instances(instances, read); status != TANDEM_OK) return status;
    if (!is_there(motion, read.count)) return TANDEM_NULL_ARGUMENT;
    if (first_unknown_motion(motion, read.count) != read.count) return TANDEM_BAD_MOTION;
    return told(self.query.keep_fixed(read, self.assets->bounds_of_all(), rows<Motion>(motion, read.count),
                                      world, stream),
                self.query);
  });
}

tandem_status tandem_gpu_broad_phase_enqueue(tandem_gpu_broad_phase* broad_phase,
                                             const tandem_gpu_instances* instances,
                                             const tandem_gpu_broad_phase_options* options,
                                             tandem_stream stream) {
  return find(broad_phase, instances, options, [&](auto& self, const auto& bodies, const auto& read) {
    return self.query.enqueue(bodies, self.assets->bounds_of_all(), read, stream);
  });
}

tandem_status tandem_gpu_broad_phase_find(tandem_gpu_broad_phase* broad_phase,
                                          const tandem_gpu_instances* instances,
                                          const tandem_gpu_broad_phase_options* options,
                                          tandem_stream stream) {
  return find(broad_phase, instances, options, [&](auto& self, const auto& bodies, const auto& read) {
    return self.query.find_pairs(bodies, self.assets->bounds_of_all(), read, stream);
  });
}

tandem_gpu_pairs tandem_gpu_broad_phase_pairs(const tandem_gpu_broad_phase* broad_phase) {
  return of_query(broad_phase, tandem_gpu_pairs{},
                  [](const GpuBroadPhase& query) { return pairs_to_c(query.pairs()); });
}
