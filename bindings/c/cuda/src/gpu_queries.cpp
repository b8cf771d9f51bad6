#include <utility>

#include "gpu_handles.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_gpu_contact_query : GpuHandle<GpuContactQuery> {
  bool grouped = false;       // the contacts of the last call are
  bool all_contacts = false;  // and are all there are, without distance

  // Returns whether what follows from contacts may be asked of it by a handle with these assets.
  tandem_status serves(const tandem_gpu_assets* with, bool needs_all) const {
    if (assets != with) return TANDEM_ASSETS_MISSING;
    return grouped && (all_contacts || !needs_all) ? TANDEM_OK : TANDEM_CONTACTS_MISSING;
  }

  void forget() { grouped = all_contacts = false; }
  void note(const GpuContactOptions& options, Status status) {
    grouped = status == Status::kOk && options.grouped;
    all_contacts =
        grouped && options.mode == QueryMode::exact && !options.first_contact_only && !options.of_clearance();
  }
};

struct tandem_gpu_manifolds : GpuHandle<GpuManifoldQuery> {};
struct tandem_gpu_containment_query : GpuHandle<GpuContainmentQuery> {};
struct tandem_gpu_distance_query : GpuHandle<GpuDistanceQuery> {};
struct tandem_gpu_probe_query : GpuHandle<GpuProbeQuery> {};
struct tandem_gpu_impact_query : GpuHandle<GpuImpactQuery> {};
struct tandem_gpu_tolerance_query : GpuHandle<GpuToleranceQuery> {};

namespace {

// The options of the libraries, and whether the caller's are sound.
template <typename Options>
using Read = std::pair<tandem_status, Options>;

struct NoOptions {};
constexpr const NoOptions* kNoOptions = nullptr;

Read<NoOptions> read_options(const NoOptions*) {
  return {TANDEM_OK, {}};
}

Read<double> read_options(const double* tolerance) {
  return {TANDEM_OK, *tolerance};
}

Read<GpuContactOptions> read_options(const tandem_gpu_query_options* given) {
  tandem_gpu_query_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return {status, {}};
  if (read.mode > TANDEM_BOXES || read.first_contact_only > 1 || read.sorted > 1 || read.grouped > 1 ||
      read.add_error_bounds > 1)
    return {TANDEM_BAD_OPTION, {}};
  GpuContactOptions options;
  options.mode = static_cast<QueryMode>(read.mode);
  options.first_contact_only = read.first_contact_only != 0;
  options.sorted = read.sorted != 0;
  options.grouped = read.grouped != 0;
  options.add_error_bounds = read.add_error_bounds != 0;
  options.within = read.within;
  options.most_blocks = read.most_blocks;
  options.leave_out_rings = read.leave_out_rings;
  return {TANDEM_OK, options};
}

Read<ManifoldOptions> read_options(const tandem_manifold_options* given) {
  ManifoldOptions options;
  const tandem_status status = read_manifold_options(given, options);
  return {status, options};
}

Read<GpuDistanceOptions> read_options(const tandem_gpu_distance_options* given) {
  tandem_gpu_distance_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return {status, {}};
  if (read.limit_reach > 1) return {TANDEM_BAD_OPTION, {}};
  GpuDistanceOptions options;
  options.tolerance.absolute = read.absolute_tolerance;
  if (read.relative_tolerance != 0) options.tolerance.relative = read.relative_tolerance;
  if (read.limit_reach != 0) options.reach = read.reach;
  options.former = reinterpret_cast<const ObjectDistance*>(read.former);
  return {TANDEM_OK, options};
}

Read<GpuClosestOptions> read_options(const tandem_gpu_closest_options* given) {
  tandem_gpu_closest_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return {status, {}};
  if (read.limit_reach > 1 || read.sides > 1) return {TANDEM_BAD_OPTION, {}};
  if (!is_there(read.points, read.point_count)) return {TANDEM_NULL_ARGUMENT, {}};
  GpuClosestOptions options;
  options.points = read.points;
  options.point_count = read.point_count;
  options.tolerance.absolute = read.absolute_tolerance;
  if (read.relative_tolerance != 0) options.tolerance.relative = read.relative_tolerance;
  if (read.limit_reach != 0) options.reach = read.reach;
  options.sides = read.sides != 0;
  options.looked_at = read.looked_at;
  return {TANDEM_OK, options};
}

Read<GpuRayOptions> read_options(const tandem_gpu_ray_options* given) {
  tandem_gpu_ray_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return {status, {}};
  if (read.limit_reach > 1) return {TANDEM_BAD_OPTION, {}};
  if (!is_there(read.origins, read.ray_count) || !is_there(read.directions, read.ray_count))
    return {TANDEM_NULL_ARGUMENT, {}};
  GpuRayOptions options;
  options.origins = read.origins;
  options.directions = read.directions;
  options.ray_count = read.ray_count;
  if (read.limit_reach != 0) options.reach = read.reach;
  options.hits = static_cast<RayHits>(read.hits);
  options.looked_at = read.looked_at;
  return {TANDEM_OK, options};
}

Read<GpuImpactOptions> read_options(const tandem_gpu_impact_options* given) {
  tandem_gpu_impact_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return {status, {}};
  if (read.sorted > 1 || read.reserved != 0) return {TANDEM_BAD_OPTION, {}};
  GpuImpactOptions options;
  options.sorted = read.sorted != 0;
  if (read.tolerance != 0) options.tolerance = read.tolerance;
  options.most_blocks = read.most_blocks;
  const tandem_status status = read_gpu_filter(read.filter, options.filter);
  return {status, options};
}

// The arguments of every call.
struct Asked {
  const tandem_gpu_instances* instances;
  const tandem_gpu_pairs* pairs;
  tandem_stream stream;
  bool finds_pairs = false;  // where `pairs` is null
};

// Runs a call of a query: call(query, instances, pairs, options).
template <typename Of, typename Given, typename Call>
tandem_status ask(Of* query, const Asked& asked, const Given* given, const Call& call) {
  return with_assets(query, [&](Of& self) -> tandem_status {
    self.forget();
    GpuInstances instances;
    GpuPairs pairs = {};
    auto [read, options] = read_options(given);
    if (read == TANDEM_OK) read = read_instances(asked.instances, instances);
    if (read == TANDEM_OK && (asked.pairs != nullptr || !asked.finds_pairs))
      read = read_pairs(asked.pairs, self.given_count.data(), pairs, asked.stream);
    if (read != TANDEM_OK) return read;
    const Status status = call(self.query, instances, pairs, options);
    self.note(options, status);
    return told(status, self.query);
  });
}

// A call that is about the contacts of another query.
template <typename Of, typename Given, typename Call>
tandem_status ask_behind(Of* query, const tandem_gpu_contact_query* contacts, bool needs_all,
                         const Asked& asked, const Given* given, const Call& call) {
  return with_assets(query, [&](Of& self) -> tandem_status {
    if (contacts == nullptr) return TANDEM_NULL_ARGUMENT;
    const tandem_status status = contacts->serves(self.assets, needs_all);
    return status == TANDEM_OK ? ask(query, asked, given, call) : status;
  });
}

// A call about bodies that move; the library looks at motions only where there are bodies.
template <typename Call>
tandem_status ask_moving(tandem_gpu_impact_query* query, const Asked& asked, const tandem_motion* motion,
                         const tandem_gpu_impact_options* given, const Call& call) {
  if (asked.instances == nullptr || is_there(motion, asked.instances->count))
    return ask(query, asked, given, call);
  return with_assets(query, [&](auto&) {
    const auto [status, options] = read_options(given);
    return status == TANDEM_OK ? tandem_status{TANDEM_NULL_ARGUMENT} : status;
  });
}

// Calls about instances alone.
template <typename Given>
tandem_status enqueue_probes(tandem_gpu_probe_query* query, const tandem_gpu_instances* instances,
                             const Given* given, tandem_stream stream) {
  return ask(
      query, {instances, nullptr, stream, true}, given,
      [&](auto& self, auto& bodies, auto&, auto& options) { return self.enqueue(bodies, options, stream); });
}

template <typename Given>
tandem_status find_probes(tandem_gpu_probe_query* query, const tandem_gpu_instances* instances,
                          const Given* given, tandem_stream stream) {
  return ask(
      query, {instances, nullptr, stream, true}, given,
      [&](auto& self, auto& bodies, auto&, auto& options) { return self.find(bodies, options, stream); });
}

}  // namespace

// All but the tolerance query look at the first level that an asset shows.
#define TANDEM_GPU_QUERY(handle, report_row)                                                          \
  TANDEM_GPU_HANDLE(handle, report_row)                                                               \
  tandem_status handle##_set_assets(handle* query, tandem_gpu_assets* assets, tandem_stream stream) { \
    return take_assets(query, assets,                                                                 \
                       [&](auto& of) { return of.set_assets(assets->assets.view(), stream); });       \
  }

TANDEM_GPU_QUERY(tandem_gpu_contact_query, tandem_gpu_query_report)
TANDEM_GPU_QUERY(tandem_gpu_manifolds, tandem_gpu_manifold_report)
TANDEM_GPU_QUERY(tandem_gpu_containment_query, tandem_gpu_containment_report)
TANDEM_GPU_QUERY(tandem_gpu_distance_query, tandem_gpu_distance_report)
TANDEM_GPU_QUERY(tandem_gpu_impact_query, tandem_gpu_impact_report)
TANDEM_GPU_QUERY(tandem_gpu_probe_query, tandem_gpu_probe_report)
TANDEM_GPU_HANDLE(tandem_gpu_tolerance_query, tandem_gpu_tolerance_report)

tandem_status tandem_gpu_contact_query_reserve(tandem_gpu_contact_query* query,
                                               const tandem_gpu_query_capacity* capacity,
                                               const tandem_gpu_query_options* given) {
  return reserve(query, capacity, [&](tandem_gpu_contact_query& self) {
    const auto [status, options] = read_options(given);
    if (status != TANDEM_OK) return status;
    self.forget();
    return told(self.query.reserve(std::bit_cast<GpuContactCapacity>(*capacity), options), self.query);
  });
}

tandem_status tandem_gpu_contact_query_enqueue(tandem_gpu_contact_query* query,
                                               const tandem_gpu_instances* instances,
                                               const tandem_gpu_pairs* pairs,
                                               const tandem_gpu_query_options* given, tandem_stream stream) {
  return ask(query, {instances, pairs, stream}, given,
             [&](auto& self, auto&... read) { return self.enqueue(read..., stream); });
}

tandem_status tandem_gpu_contact_query_find(tandem_gpu_contact_query* query,
                                            const tandem_gpu_instances* instances,
                                            const tandem_gpu_pairs* pairs,
                                            const tandem_gpu_query_options* given, tandem_stream stream) {
  return ask(query, {instances, pairs, stream}, given,
             [&](auto& self, auto&... read) { return self.find_contacts(read..., stream); });
}

const tandem_contact* tandem_gpu_contact_query_contacts(const tandem_gpu_contact_query* query) {
  return rows_of<tandem_contact>(query, &GpuContactQuery::contacts);
}

tandem_gpu_contact_groups tandem_gpu_contact_query_groups(const tandem_gpu_contact_query* query) {
  return of_query(query, tandem_gpu_contact_groups{}, [](const GpuContactQuery& of) {
    const GpuContactGroups groups = of.groups();
    return tandem_gpu_contact_groups{reinterpret_cast<const tandem_contact*>(groups.contacts),
                                     groups.first_contact, groups.few, groups.many,
                                     reinterpret_cast<const tandem_gpu_group_counts*>(groups.counts)};
  });
}

const uint32_t* tandem_gpu_contact_query_met(const tandem_gpu_contact_query* query) {
  return rows_of<uint32_t>(query, &GpuContactQuery::met);
}

tandem_status tandem_gpu_manifolds_reserve(tandem_gpu_manifolds* manifolds,
                                           const tandem_gpu_manifold_capacity* capacity) {
  return reserve<GpuManifoldCapacity>(manifolds, capacity);
}

tandem_status tandem_gpu_manifolds_enqueue(tandem_gpu_manifolds* manifolds,
                                           const tandem_gpu_instances* instances,
                                           const tandem_gpu_pairs* pairs,
                                           const tandem_gpu_contact_query* query,
                                           const tandem_manifold_options* given, tandem_stream stream) {
  return ask_behind(manifolds, query, false, {instances, pairs, stream}, given,
                    [&](auto& self, auto& bodies, auto& of, auto& options) {
                      return self.enqueue(bodies, of, query->query, options, stream);
                    });
}

tandem_status tandem_gpu_manifolds_find(tandem_gpu_manifolds* manifolds,
                                        const tandem_gpu_instances* instances, const tandem_gpu_pairs* pairs,
                                        const tandem_gpu_contact_query* query,
                                        const tandem_manifold_options* given, tandem_stream stream) {
  return ask_behind(manifolds, query, false, {instances, pairs, stream}, given,
                    [&](auto& self, auto& bodies, auto& of, auto& options) {
                      return self.make(bodies, of, query->query, options, stream);
                    });
}

const tandem_manifold* tandem_gpu_manifolds_manifolds(const tandem_gpu_manifolds* manifolds) {
  return rows_of<tandem_manifold>(manifolds, &GpuManifoldQuery::manifolds);
}

const tandem_manifold_point* tandem_gpu_manifolds_points(const tandem_gpu_manifolds* manifolds) {
  return rows_of<tandem_manifold_point>(manifolds, &GpuManifoldQuery::points);
}

tandem_status tandem_gpu_containment_query_reserve(tandem_gpu_containment_query* query,
                                                   const tandem_gpu_containment_capacity* capacity) {
  return reserve<GpuContainmentCapacity>(query, capacity);
}

tandem_status tandem_gpu_containment_query_enqueue(tandem_gpu_containment_query* query,
                                                   const tandem_gpu_instances* instances,
                                                   const tandem_gpu_pairs* pairs,
                                                   const tandem_gpu_contact_query* contacts,
                                                   tandem_stream stream) {
  return ask_behind(query, contacts, true, {instances, pairs, stream}, kNoOptions,
                    [&](auto& self, auto& bodies, auto& of, auto&) {
                      return self.enqueue(bodies, of, contacts->query, stream);
                    });
}

tandem_status tandem_gpu_containment_query_find(tandem_gpu_containment_query* query,
                                                const tandem_gpu_instances* instances,
                                                const tandem_gpu_pairs* pairs,
                                                const tandem_gpu_contact_query* contacts,
                                                tandem_stream stream) {
  return ask_behind(query, contacts, true, {instances, pairs, stream}, kNoOptions,
                    [&](auto& self, auto& bodies, auto& of, auto&) {
                      return self.find(bodies, of, contacts->query, stream);
                    });
}

const tandem_containment* tandem_gpu_containment_query_contained(const tandem_gpu_containment_query* query) {
  return rows_of<tandem_containment>(query, &GpuContainmentQuery::contained);
}

tandem_status tandem_gpu_distance_query_reserve(tandem_gpu_distance_query* query,
                                                const tandem_gpu_distance_capacity* capacity) {
  return reserve<GpuDistanceCapacity>(query, capacity);
}

tandem_status tandem_gpu_distance_query_enqueue(tandem_gpu_distance_query* query,
                                                const tandem_gpu_instances* instances,
                                                const tandem_gpu_pairs* pairs,
                                                const tandem_gpu_distance_options* given,
                                                tandem_stream stream) {
  return ask(query, {instances, pairs, stream}, given,
             [&](auto& self, auto&... read) { return self.enqueue(read..., stream); });
}

tandem_status tandem_gpu_distance_query_find(tandem_gpu_distance_query* query,
                                             const tandem_gpu_instances* instances,
                                             const tandem_gpu_pairs* pairs,
                                             const tandem_gpu_distance_options* given, tandem_stream stream) {
  return ask(query, {instances, pairs, stream}, given,
             [&](auto& self, auto&... read) { return self.find_distances(read..., stream); });
}

const tandem_distance* tandem_gpu_distance_query_distances(const tandem_gpu_distance_query* query) {
  return rows_of<tandem_distance>(query, &GpuDistanceQuery::distances);
}

tandem_status tandem_gpu_impact_query_reserve(tandem_gpu_impact_query* query,
                                              const tandem_gpu_impact_capacity* capacity,
                                              const tandem_gpu_impact_options* given) {
  return reserve(query, capacity, [&](tandem_gpu_impact_query& self) {
    const auto [status, options] = read_options(given);
    if (status != TANDEM_OK) return status;
    return told(self.query.reserve(std::bit_cast<GpuImpactCapacity>(*capacity), options), self.query);
  });
}

tandem_status tandem_gpu_impact_query_enqueue(tandem_gpu_impact_query* query,
                                              const tandem_gpu_instances* instances,
                                              const tandem_motion* motion, double duration,
                                              const tandem_gpu_pairs* pairs,
                                              const tandem_gpu_impact_options* given, tandem_stream stream) {
  const auto* const moves = reinterpret_cast<const RigidMotion*>(motion);
  return ask_moving(query, {instances, pairs, stream, true}, motion, given,
                    [&](auto& self, auto& bodies, auto& of, auto& options) {
                      return self.enqueue(bodies, moves, duration, of, options, stream);
                    });
}

tandem_status tandem_gpu_impact_query_find(tandem_gpu_impact_query* query,
                                           const tandem_gpu_instances* instances, const tandem_motion* motion,
                                           double duration, const tandem_gpu_pairs* pairs,
                                           const tandem_gpu_impact_options* given, tandem_stream stream) {
  const auto* const moves = reinterpret_cast<const RigidMotion*>(motion);
  return ask_moving(query, {instances, pairs, stream, true}, motion, given,
                    [&](auto& self, auto& bodies, auto& of, auto& options) {
                      return self.find(bodies, moves, duration, of, options, stream);
                    });
}

tandem_gpu_pairs tandem_gpu_impact_query_pairs(const tandem_gpu_impact_query* query) {
  return of_query(query, tandem_gpu_pairs{}, [](const GpuImpactQuery& of) { return pairs_to_c(of.pairs()); });
}

const tandem_impact* tandem_gpu_impact_query_impacts(const tandem_gpu_impact_query* query) {
  return rows_of<tandem_impact>(query, &GpuImpactQuery::impacts);
}

tandem_status tandem_gpu_tolerance_query_set_assets(tandem_gpu_tolerance_query* query,
                                                    tandem_gpu_assets* assets, tandem_stream stream) {
  return take_assets(query, assets, [&](auto& of) { return of.set_assets(assets->levels.view(), stream); });
}

tandem_status tandem_gpu_tolerance_query_reserve(tandem_gpu_tolerance_query* query,
                                                 const tandem_gpu_tolerance_capacity* capacity) {
  return reserve<GpuToleranceCapacity>(query, capacity);
}

tandem_status tandem_gpu_tolerance_query_enqueue(tandem_gpu_tolerance_query* query,
                                                 const tandem_gpu_instances* instances,
                                                 const tandem_gpu_pairs* pairs, double tolerance,
                                                 tandem_stream stream) {
  return ask(query, {instances, pairs, stream}, &tolerance,
             [&](auto& self, auto&... read) { return self.enqueue(read..., stream); });
}

tandem_status tandem_gpu_tolerance_query_find(tandem_gpu_tolerance_query* query,
                                              const tandem_gpu_instances* instances,
                                              const tandem_gpu_pairs* pairs, double tolerance,
                                              tandem_stream stream) {
  return ask(query, {instances, pairs, stream}, &tolerance,
             [&](auto& self, auto&... read) { return self.decide(read..., stream); });
}

const tandem_verdict* tandem_gpu_tolerance_query_verdicts(const tandem_gpu_tolerance_query* query) {
  return rows_of<tandem_verdict>(query, &GpuToleranceQuery::verdicts);
}

tandem_status tandem_gpu_probe_query_reserve(tandem_gpu_probe_query* query,
                                             const tandem_gpu_probe_capacity* capacity) {
  return reserve<GpuProbeCapacity>(query, capacity);
}

tandem_status tandem_gpu_probe_query_enqueue_closest(tandem_gpu_probe_query* query,
                                                     const tandem_gpu_instances* instances,
                                                     const tandem_gpu_closest_options* given,
                                                     tandem_stream stream) {
  return enqueue_probes(query, instances, given, stream);
}

tandem_status tandem_gpu_probe_query_find_closest(tandem_gpu_probe_query* query,
                                                  const tandem_gpu_instances* instances,
                                                  const tandem_gpu_closest_options* given,
                                                  tandem_stream stream) {
  return find_probes(query, instances, given, stream);
}

const tandem_closest_point* tandem_gpu_probe_query_closest(const tandem_gpu_probe_query* query) {
  return rows_of<tandem_closest_point>(query, &GpuProbeQuery::closest);
}

tandem_status tandem_gpu_probe_query_enqueue_rays(tandem_gpu_probe_query* query,
                                                  const tandem_gpu_instances* instances,
                                                  const tandem_gpu_ray_options* given, tandem_stream stream) {
  return enqueue_probes(query, instances, given, stream);
}

tandem_status tandem_gpu_probe_query_find_rays(tandem_gpu_probe_query* query,
                                               const tandem_gpu_instances* instances,
                                               const tandem_gpu_ray_options* given, tandem_stream stream) {
  return find_probes(query, instances, given, stream);
}

const tandem_ray_hit* tandem_gpu_probe_query_rays(const tandem_gpu_probe_query* query) {
  return rows_of<tandem_ray_hit>(query, &GpuProbeQuery::hits);
}
