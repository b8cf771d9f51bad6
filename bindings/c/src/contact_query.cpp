#include "tandem/kernels/contact_query.h"

#include "handles.h"
#include "rows.h"

using namespace tandem;
using namespace tandem::c;

namespace {

// What the last call found.
enum class Found { nothing, pairs, contacts, all_contacts };

}  // namespace

struct tandem_contact_query : Handle {
  ContactQuery query;
  ManifoldQuery manifolds;
  ContainmentQuery containment;
  Found found = Found::nothing;
  // Whether the two have the assets, and what they made of the last contacts.
  bool manifolds_named = false, containment_named = false;
  bool manifolds_made = false, contained_found = false;

  void forget_results() {
    found = Found::nothing;
    manifolds_made = contained_found = false;
  }
};

namespace {

struct Options {
  ContactOptions query;
  PairFilter filter;
};

tandem_status read_options(const tandem_query_options* given, size_t instances, Options& options,
                           uint64_t& where) {
  tandem_query_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.mode > TANDEM_BOXES || read.first_contact_only > 1 || read.self_pairs > 1 ||
      read.add_error_bounds > 1)
    return TANDEM_BAD_OPTION;
  options.query.mode = static_cast<QueryMode>(read.mode);
  options.query.first_contact_only = read.first_contact_only != 0;
  options.query.self_pairs = read.self_pairs != 0;
  options.query.threads = read.threads;
  options.query.within = read.within;
  options.query.add_error_bounds = read.add_error_bounds != 0;
  if (read.filter == nullptr) return TANDEM_OK;
  options.query.filter = &options.filter;
  return read_filter(*read.filter, instances, options.filter, where);
}

Found found_with(const ContactOptions& options) {
  const bool all = options.mode == QueryMode::exact && !options.first_contact_only && options.within == 0 &&
                   !options.add_error_bounds;
  return all ? Found::all_contacts : Found::contacts;
}

// A call that finds pairs, and contacts where `found` of the options says so.
template <typename Find>
tandem_status find(tandem_contact_query* query, bool lists_there, const tandem_instance* instances,
                   size_t count, const tandem_query_options* given, const Find& body) {
  return enter(query, [&](tandem_contact_query& self) {
    self.forget_results();
    if (!lists_there) return tandem_status{TANDEM_NULL_ARGUMENT};
    Options options;
    const tandem_status status = read_options(given, count, options, self.where);
    if (status != TANDEM_OK) return status;
    const Status done = body(self, rows<Instance>(instances, count), options.query);
    return done == Status::kOk ? tandem_status{TANDEM_OK} : self.fail(to_c(done), self.query.where());
  });
}

}  // namespace

tandem_status tandem_contact_query_create(const tandem_allocator* allocator, tandem_contact_query** query) {
  return create(allocator, query);
}

void tandem_contact_query_destroy(tandem_contact_query* query) {
  delete query;
}

tandem_status tandem_contact_query_set_assets(tandem_contact_query* query, tandem_asset* const* assets,
                                              size_t count) {
  return enter(query, [&](tandem_contact_query& self) {
    self.forget_results();
    // They may point to what goes now.
    (void)self.manifolds.set_assets({});
    (void)self.containment.set_assets({});
    self.manifolds_named = self.containment_named = false;
    return self.name_assets(self.query, assets, count);
  });
}

tandem_status tandem_contact_query_keep_fixed(tandem_contact_query* query, const tandem_instance* instances,
                                              const uint8_t* motion, size_t count, uint32_t threads) {
  return enter(query, [&](tandem_contact_query& self) -> tandem_status {
    self.forget_results();
    if (!is_there(instances, count) || !is_there(motion, count)) return TANDEM_NULL_ARGUMENT;
    const size_t unknown = first_unknown_motion(motion, count);
    if (unknown != count) return self.fail(TANDEM_BAD_OPTION, unknown);
    ContactOptions options;
    options.threads = threads;
    const Status done =
        self.query.keep_fixed(rows<Instance>(instances, count), rows<Motion>(motion, count), options);
    return done == Status::kOk ? tandem_status{TANDEM_OK} : self.fail(to_c(done), self.query.where());
  });
}

tandem_status tandem_contact_query_find_pairs(tandem_contact_query* query, const tandem_instance* instances,
                                              size_t count, const tandem_query_options* options) {
  return find(query, is_there(instances, count), instances, count, options,
              [](auto& self, auto bodies, const ContactOptions& read) {
                const Status status = self.query.find_pairs(bodies, read);
                if (status == Status::kOk) self.found = Found::pairs;
                return status;
              });
}

tandem_status tandem_contact_query_find_contacts(tandem_contact_query* query,
                                                 const tandem_instance* instances, size_t count,
                                                 const tandem_query_options* options) {
  return find(query, is_there(instances, count), instances, count, options,
              [](auto& self, auto bodies, const ContactOptions& read) {
                const Status status = self.query.find_contacts(bodies, read);
                if (status == Status::kOk) self.found = found_with(read);
                return status;
              });
}

tandem_status tandem_contact_query_find_contacts_of_pairs(tandem_contact_query* query,
                                                          const tandem_instance* instances, size_t count,
                                                          const tandem_object_pair* pairs, size_t pair_count,
                                                          const tandem_query_options* options) {
  const bool lists_there = is_there(instances, count) && is_there(pairs, pair_count);
  return find(query, lists_there, instances, count, options,
              [&](auto& self, auto bodies, const ContactOptions& read) {
                const Status status =
                    self.query.find_contacts(bodies, rows<ObjectPair>(pairs, pair_count), read);
                if (status == Status::kOk) self.found = found_with(read);
                return status;
              });
}

const tandem_object_pair* tandem_contact_query_pairs(const tandem_contact_query* query, size_t* count) {
  const bool there = query != nullptr && query->found != Found::nothing;
  return result<tandem_object_pair>(there ? query->query.pairs() : std::span<const ObjectPair>(), count);
}

const tandem_contact* tandem_contact_query_contacts(const tandem_contact_query* query, size_t* count) {
  const bool there = query != nullptr && query->found >= Found::contacts;
  return result<tandem_contact>(there ? query->query.contacts() : std::span<const Contact>(), count);
}

uint64_t tandem_contact_query_where(const tandem_contact_query* query) {
  return query != nullptr ? query->where : 0;
}

tandem_status tandem_contact_query_get_counters(const tandem_contact_query* query,
                                                tandem_query_counters* counters) {
  if (query == nullptr) return TANDEM_NULL_ARGUMENT;
  const ContactCounters from = query->found != Found::nothing ? query->query.counters() : ContactCounters();
  tandem_query_counters filled = {};
  filled.object_pairs = from.object_pairs;
  filled.block_pairs = from.block_pairs;
  filled.candidates = from.candidates;
  filled.decided_by_float32 = from.decided_by_float32;
  filled.decided_by_float64 = from.decided_by_float64;
  filled.decided_exactly = from.decided_exactly;
  filled.contacts = from.contacts;
  return write_struct(filled, counters);
}

tandem_status tandem_contact_query_make_manifolds(tandem_contact_query* query,
                                                  const tandem_instance* instances, size_t count,
                                                  const tandem_manifold_options* given) {
  return enter(query, [&](tandem_contact_query& self) -> tandem_status {
    self.manifolds_made = false;
    tandem_manifold_options read;
    tandem_status status = read_struct(given, read);
    if (status == TANDEM_OK && (read.most_points > kMostManifoldPoints || read.ignore_previous > 1))
      status = TANDEM_BAD_OPTION;
    if (status == TANDEM_OK && !is_there(instances, count)) status = TANDEM_NULL_ARGUMENT;
    if (status == TANDEM_OK && self.found < Found::contacts) status = TANDEM_CONTACTS_MISSING;
    if (status != TANDEM_OK) {
      self.manifolds.forget_points();
      return status;
    }
    Status done = self.manifolds_named ? Status::kOk : self.manifolds.set_assets(self.assets.views());
    self.manifolds_named = done == Status::kOk;
    ManifoldOptions options;
    options.match_previous = read.ignore_previous == 0;
    options.most_points = read.most_points != 0 ? read.most_points : kMostManifoldPoints;
    options.threads = read.threads;
    if (done == Status::kOk)
      done = self.manifolds.make(rows<Instance>(instances, count), self.query.pairs(), self.query.contacts(),
                                 options);
    self.manifolds_made = done == Status::kOk;
    return self.manifolds_made ? tandem_status{TANDEM_OK} : self.fail(to_c(done), self.manifolds.where());
  });
}

const tandem_manifold* tandem_contact_query_manifolds(const tandem_contact_query* query, size_t* count) {
  const bool there = query != nullptr && query->manifolds_made;
  return result<tandem_manifold>(there ? query->manifolds.manifolds() : std::span<const Manifold>(), count);
}

const tandem_manifold_point* tandem_contact_query_points(const tandem_contact_query* query, size_t* count) {
  const bool there = query != nullptr && query->manifolds_made;
  return result<tandem_manifold_point>(there ? query->manifolds.points() : std::span<const ManifoldPoint>(),
                                       count);
}

tandem_status tandem_contact_query_find_contained(tandem_contact_query* query,
                                                  const tandem_instance* instances, size_t count,
                                                  uint32_t threads) {
  return enter(query, [&](tandem_contact_query& self) -> tandem_status {
    self.contained_found = false;
    if (!is_there(instances, count)) return TANDEM_NULL_ARGUMENT;
    if (self.found != Found::all_contacts) return TANDEM_CONTACTS_MISSING;
    Status done = self.containment_named ? Status::kOk : self.containment.set_assets(self.assets.views());
    self.containment_named = done == Status::kOk;
    if (done == Status::kOk)
      done = self.containment.find(rows<Instance>(instances, count), self.query.pairs(),
                                   self.query.contacts(), threads);
    self.contained_found = done == Status::kOk;
    return self.contained_found ? tandem_status{TANDEM_OK} : self.fail(to_c(done), self.containment.where());
  });
}

const tandem_containment* tandem_contact_query_contained(const tandem_contact_query* query, size_t* count) {
  const bool there = query != nullptr && query->contained_found;
  return result<tandem_containment>(there ? query->containment.contained() : std::span<const Containment>(),
                                    count);
}
