#include "tandem/kernels/tolerance_query.h"

#include "handles.h"
#include "rows.h"

using namespace tandem;
using namespace tandem::c;

struct tandem_tolerance_query : Handle {
  ToleranceQuery query;
  bool found = false;
};

namespace {

struct Options {
  ToleranceOptions query;
  PairFilter filter;
};

tandem_status read_options(const tandem_tolerance_options* given, size_t instances, Options& options,
                           uint64_t& where) {
  tandem_tolerance_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  options.query.threads = read.threads;
  options.query.tolerance = read.tolerance;
  if (read.filter == nullptr) return TANDEM_OK;
  options.query.filter = &options.filter;
  return read_filter(*read.filter, instances, options.filter, where);
}

template <typename Find>
tandem_status find(tandem_tolerance_query* query, bool lists_there, const tandem_instance* instances,
                   size_t count, const tandem_tolerance_options* given, const Find& body) {
  return enter(query, [&](tandem_tolerance_query& self) {
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

tandem_status tandem_tolerance_query_create(const tandem_allocator* allocator,
                                            tandem_tolerance_query** query) {
  return create(allocator, query);
}

void tandem_tolerance_query_destroy(tandem_tolerance_query* query) {
  delete query;
}

tandem_status tandem_tolerance_query_set_assets(tandem_tolerance_query* query, tandem_asset* const* assets,
                                                size_t count) {
  return enter(query, [&](tandem_tolerance_query& self) {
    self.found = false;
    return self.name_assets(self.query, assets, count);
  });
}

tandem_status tandem_tolerance_query_decide(tandem_tolerance_query* query, const tandem_instance* instances,
                                            size_t count, const tandem_tolerance_options* options) {
  return find(
      query, is_there(instances, count), instances, count, options,
      [](auto& self, auto bodies, const ToleranceOptions& read) { return self.decide(bodies, read); });
}

tandem_status tandem_tolerance_query_decide_pairs(tandem_tolerance_query* query,
                                                  const tandem_instance* instances, size_t count,
                                                  const tandem_object_pair* pairs, size_t pair_count,
                                                  const tandem_tolerance_options* options) {
  const bool lists_there = is_there(instances, count) && is_there(pairs, pair_count);
  return find(query, lists_there, instances, count, options,
              [&](auto& self, auto bodies, const ToleranceOptions& read) {
                return self.decide(bodies, rows<ObjectPair>(pairs, pair_count), read);
              });
}

const tandem_object_pair* tandem_tolerance_query_pairs(const tandem_tolerance_query* query, size_t* count) {
  const bool there = query != nullptr && query->found;
  return result<tandem_object_pair>(there ? query->query.pairs() : std::span<const ObjectPair>(), count);
}

const tandem_verdict* tandem_tolerance_query_verdicts(const tandem_tolerance_query* query, size_t* count) {
  const bool there = query != nullptr && query->found;
  return result<tandem_verdict>(there ? query->query.verdicts() : std::span<const PairVerdict>(), count);
}

uint64_t tandem_tolerance_query_where(const tandem_tolerance_query* query) {
  return query != nullptr ? query->where : 0;
}
