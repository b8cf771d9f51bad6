#include "query.h"

namespace tandem::python {

void QueuedCalls::begin(const Stream& stream) {
  cudaStreamCaptureStatus capture = cudaStreamCaptureStatusNone;
  check_cuda(cudaStreamIsCapturing(stream, &capture));
  captured_ = captured_ || capture != cudaStreamCaptureStatusNone;
  stream_ = stream;
}

void QueuedCalls::synchronize(const Stream* stream) const {
  const cudaStream_t waited = stream != nullptr ? *stream : stream_;
  const bool all = stream == nullptr && captured_;
  const cudaError_t error = [&] {
    const WithoutLock other_threads_run;
    return all ? cudaDeviceSynchronize() : cudaStreamSynchronize(waited);
  }();
  check_cuda(error);
  assets_.check_queued();
}

Step::Step(nb::object assets, std::uint32_t instances, std::uint32_t pairs, std::uint64_t contacts,
           std::uint64_t undecided, std::uint32_t mode, bool first_contact_only, double within,
           bool add_error_bounds, std::uint32_t leave_out_rings, bool sorted, bool grouped)
    : QueuedCalls(assets),
      options_(sized<tandem_gpu_query_options>()),
      near_(sized<tandem_gpu_broad_phase_options>()),
      pair_room_(pairs),
      contact_room_(contacts) {
  options_.mode = mode;
  options_.first_contact_only = first_contact_only;
  options_.within = near_.within = within;
  options_.add_error_bounds = add_error_bounds;
  options_.leave_out_rings = leave_out_rings;
  options_.sorted = near_.sorted = sorted;
  options_.grouped = grouped;
  const OnDevice current(assets_.device());
  broad_phase_ = BroadPhases::make(assets_, Stream());
  contacts_ = ContactQueries::make(assets_, Stream());
  static_cast<void>(assets_.zeros(instances));  // so that nothing need be made in a capture
  const tandem_gpu_broad_phase_capacity near_room = {instances, pairs};
  const tandem_gpu_query_capacity room = {pairs, 0, contacts, undecided};
  check_whole(tandem_gpu_broad_phase_reserve(broad_phase_.get(), &near_room, &near_));
  check_whole(tandem_gpu_contact_query_reserve(contacts_.get(), &room, &options_));
}

void Step::reserve_manifolds(std::uint32_t manifolds, std::uint32_t points, std::uint32_t most_points,
                             bool match_previous) {
  const OnDevice current(assets_.device());
  const auto made = ManifoldMakers::make(assets_, Stream());
  const tandem_gpu_manifold_capacity room = {pair_room_, 0, contact_room_, manifolds, points};
  check_whole(tandem_gpu_manifolds_reserve(made.get(), &room));
  manifold_room_ = {manifolds, points, most_points, match_previous};
  manifolds_ = made;
}

void Step::enqueue(nb::object instances, nb::object pairs, nb::object filter, const Stream& stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(assets_.device());
  const Instances& bodies = bodies_of(instances, assets_.device());
  begin(stream);
  tandem_gpu_pairs of = {};
  if (pairs.is_none()) {
    near_.filter = filter.is_none() ? nullptr : GpuFilter::of(&nb::cast<const GpuFilter&>(filter), bodies);
    check_whole(tandem_gpu_broad_phase_enqueue(broad_phase_.get(), &bodies.get(), &near_, stream));
    of = tandem_gpu_broad_phase_pairs(broad_phase_.get());
  } else {
    of = nb::cast<const Pairs&>(pairs).get();
  }
  check_whole(tandem_gpu_contact_query_enqueue(contacts_.get(), &bodies.get(), &of, &options_, stream));
  if (manifolds_ != nullptr) {
    auto options = sized<tandem_manifold_options>();
    options.most_points = manifold_room_.most_points;
    options.ignore_previous = !manifold_room_.match_previous;
    check_whole(tandem_gpu_manifolds_enqueue(manifolds_.get(), &bodies.get(), &of, contacts_.get(), &options,
                                             stream));
  }
  instances_ = instances;
  given_ = pairs;
  filter_ = filter;
}

Rows Step::pairs() const {
  const tandem_gpu_pairs pairs = tandem_gpu_broad_phase_pairs(broad_phase_.get());
  return {memory_of(broad_phase_), pairs.pairs, pairs.capacity, sizeof(tandem_object_pair)};
}

Array Step::pair_count() const {
  const tandem_gpu_pairs pairs = tandem_gpu_broad_phase_pairs(broad_phase_.get());
  return {memory_of(broad_phase_), pairs.count, kU32, {1}, {1}};
}

Rows Step::contacts() const {
  return {memory_of(contacts_), tandem_gpu_contact_query_contacts(contacts_.get()), contact_room_,
          sizeof(tandem_contact)};
}

Rows Step::report() const {
  return {memory_of(contacts_), tandem_gpu_contact_query_device_report(contacts_.get()), 1,
          sizeof(tandem_gpu_query_report)};
}

Array Step::first_contact() const {
  if (options_.grouped == 0) throw nb::value_error("contacts are not grouped");
  const tandem_gpu_contact_groups groups = tandem_gpu_contact_query_groups(contacts_.get());
  const auto pairs = std::int64_t{tandem_gpu_broad_phase_pairs(broad_phase_.get()).capacity};
  return {memory_of(contacts_), groups.first_contact, kU32, {pairs + 1}, {1}};
}

void Step::require_manifolds() const {
  if (manifolds_ == nullptr) throw nb::value_error("no room for manifolds was reserved");
}

Rows Step::manifolds() const {
  require_manifolds();
  return {memory_of(manifolds_), tandem_gpu_manifolds_manifolds(manifolds_.get()), manifold_room_.manifolds,
          sizeof(tandem_manifold)};
}

Rows Step::points() const {
  require_manifolds();
  return {memory_of(manifolds_), tandem_gpu_manifolds_points(manifolds_.get()), manifold_room_.points,
          sizeof(tandem_manifold_point)};
}

Rows Step::manifold_report() const {
  require_manifolds();
  return {memory_of(manifolds_), tandem_gpu_manifolds_device_report(manifolds_.get()), 1,
          sizeof(tandem_gpu_manifold_report)};
}

nb::tuple Step::wait(nb::handle given, const Stream* stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(assets_.device());
  synchronize(stream);
  std::uint64_t pairs = 0;
  if (!given.is_none()) {
    pairs = nb::cast<const Pairs&>(given).count();
  } else {
    pairs = checked_report(tandem_gpu_broad_phase_get_report, broad_phase_.get()).found;
  }
  const auto report = checked_report(tandem_gpu_contact_query_get_report, contacts_.get());
  tandem_gpu_manifold_report made = {};
  made.complete = 1;
  if (manifolds_ != nullptr && report.complete != 0)
    check_whole(tandem_gpu_manifolds_get_report(manifolds_.get(), &made));
  const bool complete = report.complete != 0 && made.complete != 0;
  return nb::make_tuple(complete, pairs, report.contacts, report.needed.pairs, report.needed.contacts,
                        report.needed.undecided, made.needed.manifolds, made.needed.points);
}

}  // namespace tandem::python
