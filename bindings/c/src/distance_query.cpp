#include "tandem/kernels/distance_query.h"

#include "handles.h"
#include "rows.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_distance_query : Handle {
  DistanceQuery query;
  bool found = false;
};

namespace {

struct Options {
  DistanceOptions query;
  PairFilter filter;
};

tandem_status read_options(const tandem_distance_options* given, size_t instances, Options& options,
                           uint64_t& where) {
  tandem_distance_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.limit_reach > 1 || read.reserved != 0) return TANDEM_BAD_OPTION;
  if (!is_there(read.former, read.former_count)) return TANDEM_NULL_ARGUMENT;
  options.query.threads = read.threads;
  options.query.tolerance.absolute = read.absolute_tolerance;
  if (read.relative_tolerance != 0) options.query.tolerance.relative = read.relative_tolerance;
  if (read.limit_reach != 0) options.query.reach = read.reach;
  options.query.former = rows<FormerNearest>(read.former, read.former_count);
  if (read.filter == nullptr) return TANDEM_OK;
  options.query.filter = &options.filter;
  return read_filter(*read.filter, instances, options.filter, where);
}

template <typename Find>
tandem_status find(tandem_distance_query* query, bool lists_there, const tandem_instance* instances,
                   size_t count, const tandem_distance_options* given, const Find& body) {
  return enter(query, [&](tandem_distance_query& self) {
    self.found = false;
    if (!lists_there) return tandem_status{TANDEM_NULL_ARGUMENT};
    Options options;
    const tandem_status status = read_options(given, count, options, self.where);
    if (status != TANDEM_OK) return status;
    const Status done = body(self.query, rows<Instance>(instances, count), options.query);
    self.found = done == Status::kOk;
    return self.found ? tandem_status{TANDEM_OK} : self.fail(to_c(done), self.query.where());
  });
}

}  // namespace

tandem_status tandem_distance_query_create(const tandem_allocator* allocator, tandem_distance_query** query) {
  return create(allocator, query);
}

void tandem_distance_query_destroy(tandem_distance_query* query) {
  delete query;
}

tandem_status tandem_distance_query_set_assets(tandem_distance_query* query, tandem_asset* const* assets,
                                               size_t count) {
  return enter(query, [&](tandem_distance_query& self) {
    self.found = false;
    return self.name_assets(self.query, assets, count);
  });
}

tandem_status tandem_distance_query_find(tandem_distance_query* query, const tandem_instance* instances,
                                         size_t count, const tandem_distance_options* options) {
  return find(
      query, is_there(instances, count), instances, count, options,
      [](auto& self, auto bodies, const DistanceOptions& read) { return self.find_distances(bodies, read); });
}

tandem_status tandem_distance_query_find_of_pairs(tandem_distance_query* query,
                                                  const tandem_instance* instances, size_t count,
                                                  const tandem_object_pair* pairs, size_t pair_count,
                                                  const tandem_distance_options* options) {
  const bool lists_there = is_there(instances, count) && is_there(pairs, pair_count);
  return find(query, lists_there, instances, count, options,
              [&](auto& self, auto bodies, const DistanceOptions& read) {
                return self.find_distances(bodies, rows<ObjectPair>(pairs, pair_count), read);
              });
}

const tandem_object_pair* tandem_distance_query_pairs(const tandem_distance_query* query, size_t* count) {
  const bool there = query != nullptr && query->found;
  return result<tandem_object_pair>(there ? query->query.pairs() : std::span<const ObjectPair>(), count);
}

const tandem_distance* tandem_distance_query_distances(const tandem_distance_query* query, size_t* count) {
  const bool there = query != nullptr && query->found;
  return result<tandem_distance>(there ? query->query.distances() : std::span<const ObjectDistance>(), count);
}

uint64_t tandem_distance_query_where(const tandem_distance_query* query) {
  return query != nullptr ? query->where : 0;
}
