#include "tandem/kernels/impact_query.h"

#include "handles.h"
#include "rows.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_impact_query : Handle {
  ImpactQuery query;
  bool found = false;
};

namespace {

struct Options {
  ImpactOptions query;
  PairFilter filter;
};

tandem_status read_options(const tandem_impact_options* given, size_t instances, Options& options,
                           uint64_t& where) {
  tandem_impact_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  options.query.threads = read.threads;
  if (read.tolerance != 0) options.query.tolerance = read.tolerance;
  if (read.filter == nullptr) return TANDEM_OK;
  options.query.filter = &options.filter;
  return read_filter(*read.filter, instances, options.filter, where);
}

template <typename Find>
tandem_status find(tandem_impact_query* query, bool lists_there, const tandem_instance* instances,
                   const tandem_motion* motion, size_t count, const tandem_impact_options* given,
                   const Find& body) {
  return enter(query, [&](tandem_impact_query& self) {
    self.found = false;
    if (!lists_there) return tandem_status{TANDEM_NULL_ARGUMENT};
    Options options;
    const tandem_status status = read_options(given, count, options, self.where);
    if (status != TANDEM_OK) return status;
    const Status done =
        body(self.query, rows<Instance>(instances, count), rows<RigidMotion>(motion, count), options.query);
    self.found = done == Status::kOk;
    return self.found ? tandem_status{TANDEM_OK} : self.fail(to_c(done), self.query.where());
  });
}

}  // namespace

tandem_status tandem_impact_query_create(const tandem_allocator* allocator, tandem_impact_query** query) {
  return create(allocator, query);
}

void tandem_impact_query_destroy(tandem_impact_query* query) {
  delete query;
}

tandem_status tandem_impact_query_set_assets(tandem_impact_query* query, tandem_asset* const* assets,
                                             size_t count) {
  return enter(query, [&](tandem_impact_query& self) {
    self.found = false;
    return self.name_assets(self.query, assets, count);
  });
}

tandem_status tandem_impact_query_find(tandem_impact_query* query, const tandem_instance* instances,
                                       const tandem_motion* motion, size_t count, double duration,
                                       const tandem_impact_options* options) {
  const bool lists_there = is_there(instances, count) && is_there(motion, count);
  return find(query, lists_there, instances, motion, count, options,
              [&](auto& self, auto bodies, auto motions, const ImpactOptions& read) {
                return self.find(bodies, motions, duration, read);
              });
}

tandem_status tandem_impact_query_find_of_pairs(tandem_impact_query* query, const tandem_instance* instances,
                                                const tandem_motion* motion, size_t count, double duration,
                                                const tandem_object_pair* pairs, size_t pair_count,
                                                const tandem_impact_options* options) {
  const bool lists_there =
      is_there(instances, count) && is_there(motion, count) && is_there(pairs, pair_count);
  return find(query, lists_there, instances, motion, count, options,
              [&](auto& self, auto bodies, auto motions, const ImpactOptions& read) {
                return self.find(bodies, motions, duration, rows<ObjectPair>(pairs, pair_count), read);
              });
}

const tandem_object_pair* tandem_impact_query_pairs(const tandem_impact_query* query, size_t* count) {
  const bool there = query != nullptr && query->found;
  return result<tandem_object_pair>(there ? query->query.pairs() : std::span<const ObjectPair>(), count);
}

const tandem_impact* tandem_impact_query_impacts(const tandem_impact_query* query, size_t* count) {
  const bool there = query != nullptr && query->found;
  return result<tandem_impact>(there ? query->query.impacts() : std::span<const Impact>(), count);
}

uint64_t tandem_impact_query_where(const tandem_impact_query* query) {
  return query != nullptr ? query->where : 0;
}

tandem_status tandem_pose_at(const tandem_pose* start, const tandem_motion* motion, double t,
                             tandem_pose* pose) {
  if (start == nullptr || motion == nullptr || pose == nullptr) return TANDEM_NULL_ARGUMENT;
  Pose from;
  RigidMotion along;
  std::memcpy(&from, start, sizeof from);
  std::memcpy(&along, motion, sizeof along);
  const Pose moved = pose_at(from, along, t);
  std::memcpy(pose, &moved, sizeof moved);
  return TANDEM_OK;
}
