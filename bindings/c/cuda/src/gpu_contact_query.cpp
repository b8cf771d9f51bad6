#include "gpu_contact_query.h"

#include "gpu_rows.h"

using namespace tandem;
using namespace tandem::c;

namespace {

tandem_status read_options(const tandem_gpu_query_options* given, GpuContactOptions& options) {
  tandem_gpu_query_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.mode > TANDEM_BOXES || read.first_contact_only > 1 || read.sorted > 1 || read.grouped > 1 ||
      read.add_error_bounds > 1 || read.reserved != 0)
    return TANDEM_BAD_OPTION;
  options.mode = static_cast<QueryMode>(read.mode);
  options.first_contact_only = read.first_contact_only != 0;
  options.sorted = read.sorted != 0;
  options.grouped = read.grouped != 0;
  options.add_error_bounds = read.add_error_bounds != 0;
  options.within = read.within;
  options.most_blocks = read.most_blocks;
  return TANDEM_OK;
}

template <typename Call>
tandem_status find(tandem_gpu_contact_query* query, const tandem_gpu_instances* given_instances,
                   const tandem_gpu_pairs* given_pairs, const tandem_gpu_query_options* given_options,
                   tandem_stream stream, const Call& call) {
  return with_assets(query, [&](tandem_gpu_contact_query& self) {
    self.grouped = self.all_contacts = false;
    GpuInstances instances;
    GpuPairs pairs;
    GpuContactOptions options;
    tandem_status status = read_options(given_options, options);
    if (status == TANDEM_OK) status = read_instances(given_instances, instances);
    if (status == TANDEM_OK) status = read_pairs(given_pairs, self.given_count.data(), pairs, stream);
    if (status == TANDEM_OK) status = told(call(self, instances, pairs, options), self.query);
    self.grouped = status == TANDEM_OK && options.grouped;
    self.all_contacts = self.grouped && options.mode == QueryMode::exact && !options.first_contact_only &&
                        !options.of_clearance();
    return status;
  });
}

}  // namespace

tandem_status tandem_gpu_contact_query_create(const tandem_allocator* allocator,
                                              tandem_gpu_contact_query** query) {
  return create_gpu(allocator, query);
}

void tandem_gpu_contact_query_destroy(tandem_gpu_contact_query* query) {
  delete query;
}

tandem_status tandem_gpu_contact_query_set_assets(tandem_gpu_contact_query* query, tandem_gpu_assets* assets,
                                                  tandem_stream stream) {
  return guarded(query, [&](tandem_gpu_contact_query& self) {
    self.grouped = self.all_contacts = false;
    return self.take(
        assets, [&] { return self.query.set_assets(assets->assets.view(), stream); },
        [&] { return self.query.reserve({}); });
  });
}

tandem_status tandem_gpu_contact_query_reserve(tandem_gpu_contact_query* query,
                                               const tandem_gpu_query_capacity* capacity,
                                               const tandem_gpu_query_options* options) {
  return with_assets(query, [&](tandem_gpu_contact_query& self) -> tandem_status {
    if (capacity == nullptr) return TANDEM_NULL_ARGUMENT;
    if (capacity->reserved != 0) return TANDEM_BAD_OPTION;
    GpuContactOptions read;
    if (const tandem_status status = read_options(options, read); status != TANDEM_OK) return status;
    self.grouped = self.all_contacts = false;
    return told(self.query.reserve({capacity->pairs, capacity->contacts, capacity->undecided}, read),
                self.query);
  });
}

tandem_status tandem_gpu_contact_query_enqueue(tandem_gpu_contact_query* query,
                                               const tandem_gpu_instances* instances,
                                               const tandem_gpu_pairs* pairs,
                                               const tandem_gpu_query_options* options,
                                               tandem_stream stream) {
  return find(query, instances, pairs, options, stream,
              [&](auto& self, const auto& bodies, const auto& of, const auto& read) {
                return self.query.enqueue(bodies, of, read, stream);
              });
}

tandem_status tandem_gpu_contact_query_find(tandem_gpu_contact_query* query,
                                            const tandem_gpu_instances* instances,
                                            const tandem_gpu_pairs* pairs,
                                            const tandem_gpu_query_options* options, tandem_stream stream) {
  return find(query, instances, pairs, options, stream,
              [&](auto& self, const auto& bodies, const auto& of, const auto& read) {
                return self.query.find_contacts(bodies, of, read, stream);
              });
}

const tandem_contact* tandem_gpu_contact_query_contacts(const tandem_gpu_contact_query* query) {
  using Rows = const tandem_contact*;
  return of_query(query, Rows{},
                  [](const GpuContactQuery& of) { return reinterpret_cast<Rows>(of.contacts()); });
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
  using Rows = const uint32_t*;
  return of_query(query, Rows{}, [](const GpuContactQuery& of) { return of.met(); });
}

const tandem_gpu_query_report* tandem_gpu_contact_query_device_report(const tandem_gpu_contact_query* query) {
  using Report = const tandem_gpu_query_report*;
  return of_query(query, Report{},
                  [](const GpuContactQuery& of) { return reinterpret_cast<Report>(of.device_report()); });
}

tandem_status tandem_gpu_contact_query_get_report(const tandem_gpu_contact_query* query,
                                                  tandem_gpu_query_report* report) {
  return get_report(query, report);
}

size_t tandem_gpu_contact_query_bytes(const tandem_gpu_contact_query* query) {
  return bytes_of(query);
}
