#include "query.h"

#include <nanobind/stl/optional.h>

#include <limits>

namespace tandem::python {
FoundPairs Query::find_pairs(const Instances& bodies, bool sorted, double within, const GpuFilter* filter,
                             const Stream& stream) {
  const auto broad_phase = broad_phases_.take(assets_, stream);
  auto options = sized<tandem_gpu_broad_phase_options>();
  options.sorted = sorted;
  options.within = within;
  options.filter = GpuFilter::of(filter, bodies);
  const auto report = BroadPhases::run(broad_phase, [&](tandem_gpu_broad_phase* query) {
    return tandem_gpu_broad_phase_find(query, &bodies.get(), &options, stream);
  });
  return {tandem_gpu_broad_phase_pairs(broad_phase.get()), broad_phase, report.count};
}

FoundPairs Query::pairs_of(nb::handle given, const Instances& bodies, bool sorted, double within,
                           const GpuFilter* filter, const Stream& stream) {
  if (given.is_none()) return find_pairs(bodies, sorted, within, filter, stream);
  const Pairs& pairs = nb::cast<const Pairs&>(given);
  return {pairs.get(), nullptr, pairs.count()};
}

nb::object Query::rows_of(const FoundPairs& pairs, const Stream& stream) const {
  if (pairs.owner == nullptr) return nb::none();
  return nb::cast(
      Rows(memory_of(pairs.owner, stream), pairs.pairs.pairs, pairs.count, sizeof(tandem_object_pair)));
}

nb::tuple Query::contacts(nb::object instances, nb::object given, std::uint32_t mode, bool first_contact_only,
                          double within, bool add_error_bounds, std::uint32_t leave_out_rings, bool sorted,
                          bool grouped, const GpuFilter* filter, const Stream& stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(device());
  const Instances& bodies = bodies_of(instances, device());
  last_.reset();
  const FoundPairs pairs = pairs_of(given, bodies, sorted, within, filter, stream);
  const auto contacts = contact_queries_.take(assets_, stream);
  auto options = sized<tandem_gpu_query_options>();
  options.mode = mode;
  options.first_contact_only = first_contact_only;
  options.sorted = sorted;
  options.grouped = grouped;
  options.add_error_bounds = add_error_bounds;
  options.within = within;
  options.leave_out_rings = leave_out_rings;
  const auto report = ContactQueries::run(contacts, [&](tandem_gpu_contact_query* query) {
    return tandem_gpu_contact_query_find(query, &bodies.get(), &pairs.pairs, &options, stream);
  });
  if (grouped) last_ = Last{instances, given, pairs, contacts, stream};
  return nb::make_tuple(rows_of(pairs, stream),
                        Rows(memory_of(contacts, stream), tandem_gpu_contact_query_contacts(contacts.get()),
                             report.contacts, sizeof(tandem_contact)),
                        counters_of(report.counters));
}

nb::object Query::pairs(nb::object instances, bool sorted, double within, const GpuFilter* filter,
                        const Stream& stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(device());
  last_.reset();
  return rows_of(find_pairs(bodies_of(instances, device()), sorted, within, filter, stream), stream);
}

const Query::Last& Query::last() const {
  if (!last_.has_value()) check_whole(TANDEM_CONTACTS_MISSING);
  return *last_;
}

// A copy of rows that stay with the query, in memory that nobody has any more, or in new one.
Rows Query::copy(const void* rows, std::size_t count, std::size_t row_bytes, const Stream& stream) {
  const std::size_t bytes = count * row_bytes;
  std::shared_ptr<Buffer> to;
  for (auto& made : copies_) {
    if (made.use_count() != 1) continue;
    if (made->bytes() < bytes) made = std::make_shared<Buffer>(bytes + bytes / 2);
    to = made;
    break;
  }
  if (to == nullptr) copies_.push_back(to = std::make_shared<Buffer>(bytes + bytes / 2));
  check_cuda(cudaMemcpyAsync(to->data(), rows, bytes, cudaMemcpyDeviceToDevice, stream));
  Memory memory = memory_of(to, stream);
  memory.ready = false;
  return {std::move(memory), to->data(), count, row_bytes};
}

nb::tuple Query::manifolds(std::uint32_t most_points, bool match_previous, bool quick_depths) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(device());
  const Last& of = last();
  if (manifolds_ == nullptr) manifolds_ = ManifoldMakers::make(assets_, of.stream);
  auto options = sized<tandem_manifold_options>();
  options.most_points = most_points;
  options.ignore_previous = !match_previous;
  options.quick_depths = quick_depths;
  const Instances& bodies = bodies_of(of.instances, device());
  const auto report = ManifoldMakers::run(manifolds_, [&](tandem_gpu_manifolds* maker) {
    return tandem_gpu_manifolds_find(maker, &bodies.get(), &of.pairs.pairs, of.contacts.get(), &options,
                                     of.stream);
  });
  // The query keeps its own, to find points again in the next step.
  tandem_gpu_manifolds* const made = manifolds_.get();
  return nb::make_tuple(
      rows_of(of.pairs, of.stream),
      copy(tandem_gpu_manifolds_manifolds(made), report.manifolds, sizeof(tandem_manifold), of.stream),
      copy(tandem_gpu_manifolds_points(made), report.points, sizeof(tandem_manifold_point), of.stream));
}

nb::tuple Query::contained() {
  const Turn turn(busy_, kBusy);
  const OnDevice current(device());
  const Last& of = last();
  if (contained_ == nullptr) contained_ = ContainmentQueries::make(assets_, of.stream);
  const Instances& bodies = bodies_of(of.instances, device());
  const auto report = ContainmentQueries::run(contained_, [&](tandem_gpu_containment_query* query) {
    return tandem_gpu_containment_query_find(query, &bodies.get(), &of.pairs.pairs, of.contacts.get(),
                                             of.stream);
  });
  return nb::make_tuple(rows_of(of.pairs, of.stream),
                        copy(tandem_gpu_containment_query_contained(contained_.get()), report.contained,
                             sizeof(tandem_containment), of.stream));
}

nb::tuple Query::distances(nb::object instances, nb::object given, std::optional<double> reach,
                           double absolute, double relative, const GpuFilter* filter, const Stream& stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(device());
  const Instances& bodies = bodies_of(instances, device());
  const double within = reach.value_or(std::numeric_limits<double>::infinity());
  const FoundPairs pairs = pairs_of(given, bodies, true, within, filter, stream);
  const auto distances = distance_queries_.take(assets_, stream);
  auto options = sized<tandem_gpu_distance_options>();
  options.limit_reach = reach.has_value();
  options.reach = reach.value_or(0);
  options.absolute_tolerance = absolute;
  options.relative_tolerance = relative;
  DistanceQueries::run(distances, [&](tandem_gpu_distance_query* query) {
    return tandem_gpu_distance_query_find(query, &bodies.get(), &pairs.pairs, &options, stream);
  });
  return nb::make_tuple(rows_of(pairs, stream), Rows(memory_of(distances, stream),
                                                     tandem_gpu_distance_query_distances(distances.get()),
                                                     pairs.count, sizeof(tandem_distance)));
}

nb::tuple Query::impacts(nb::object instances, nb::object motion, double duration, nb::object given,
                         double tolerance, bool sorted, const GpuFilter* filter, const Stream& stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(device());
  const Instances& bodies = bodies_of(instances, device());
  const GivenArray moves(motion, "motion", stream, device());
  moves.require_type({kF64}, "float64");
  const auto count = static_cast<std::int64_t>(bodies.count());
  const std::vector<std::int64_t>& shape = moves.shape();
  const bool flat = shape == std::vector<std::int64_t>{count, 9};
  if (!flat && shape != std::vector<std::int64_t>{count, 3, 3})
    moves.wrong_shape(
        ("(" + std::to_string(count) + ", 9) or (" + std::to_string(count) + ", 3, 3)").c_str());
  const auto impacts = impact_queries_.take(assets_, stream);
  auto options = sized<tandem_gpu_impact_options>();
  options.sorted = sorted;
  options.tolerance = tolerance;
  options.filter = GpuFilter::of(filter, bodies);
  const tandem_gpu_pairs* const of = given.is_none() ? nullptr : &nb::cast<const Pairs&>(given).get();
  const auto report = ImpactQueries::run(impacts, [&](tandem_gpu_impact_query* query) {
    const auto* rows = static_cast<const tandem_motion*>(moves.data());
    return tandem_gpu_impact_query_find(query, &bodies.get(), rows, duration, of, &options, stream);
  });
  FoundPairs pairs = {tandem_gpu_impact_query_pairs(impacts.get()), nullptr, report.impacts};
  if (of == nullptr) pairs.owner = impacts;
  return nb::make_tuple(rows_of(pairs, stream),
                        Rows(memory_of(impacts, stream), tandem_gpu_impact_query_impacts(impacts.get()),
                             report.impacts, sizeof(tandem_impact)));
}

nb::tuple Query::verdicts(nb::object instances, double tolerance, nb::object given, const GpuFilter* filter,
                          const Stream& stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(device());
  const Instances& bodies = bodies_of(instances, device());
  const FoundPairs pairs = pairs_of(given, bodies, true, 0, filter, stream);
  const auto verdicts = tolerance_queries_.take(assets_, stream);
  ToleranceQueries::run(verdicts, [&](tandem_gpu_tolerance_query* query) {
    return tandem_gpu_tolerance_query_find(query, &bodies.get(), &pairs.pairs, tolerance, stream);
  });
  return nb::make_tuple(rows_of(pairs, stream),
                        Rows(memory_of(verdicts, stream), tandem_gpu_tolerance_query_verdicts(verdicts.get()),
                             pairs.count, sizeof(tandem_verdict)));
}

void add_gpu_queries(nb::module_& module) {
  nb::class_<Query>(module, "Query")
      .def(nb::init<nb::object>())
      .def("contacts", &Query::contacts, nb::arg(), nb::arg().none(), nb::arg(), nb::arg(), nb::arg(),
           nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg().none(), nb::arg())
      .def("pairs", &Query::pairs, nb::arg(), nb::arg(), nb::arg(), nb::arg().none(), nb::arg())
      .def("manifolds", &Query::manifolds)
      .def("contained", &Query::contained)
      .def("distances", &Query::distances, nb::arg(), nb::arg().none(), nb::arg().none(), nb::arg(),
           nb::arg(), nb::arg().none(), nb::arg())
      .def("impacts", &Query::impacts, nb::arg(), nb::arg(), nb::arg(), nb::arg().none(), nb::arg(),
           nb::arg(), nb::arg().none(), nb::arg())
      .def("closest", &Query::probe<Points>)
      .def("rays", &Query::probe<Rays>)
      .def("verdicts", &Query::verdicts, nb::arg(), nb::arg(), nb::arg().none(), nb::arg().none(), nb::arg());
  nb::class_<Step>(module, "Step")
      .def(nb::init<nb::object, std::uint32_t, std::uint32_t, std::uint64_t, std::uint64_t, std::uint32_t,
                    bool, double, bool, std::uint32_t, bool, bool>())
      .def("reserve_manifolds", &Step::reserve_manifolds)
      .def("enqueue", &Step::enqueue, nb::arg(), nb::arg().none(), nb::arg().none(), nb::arg())
      .def("pairs", &Step::pairs)
      .def("pair_count", &Step::pair_count)
      .def("contacts", &Step::contacts)
      .def("report", &Step::report)
      .def("first_contact", &Step::first_contact)
      .def("manifolds", &Step::manifolds)
      .def("points", &Step::points)
      .def("manifold_report", &Step::manifold_report)
      .def("wait", &Step::wait, nb::arg().none(), nb::arg().none());
  nb::class_<Points>(module, "Points")
      .def(nb::init<nb::handle, std::optional<double>, double, double, bool, const Stream&, int>(), nb::arg(),
           nb::arg().none(), nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg());
  nb::class_<Rays>(module, "Rays")
      .def(nb::init<nb::handle, nb::handle, std::optional<double>, std::uint32_t, const Stream&, int>(),
           nb::arg(), nb::arg(), nb::arg().none(), nb::arg(), nb::arg(), nb::arg());
  nb::class_<ProbeStep>(module, "ProbeStep")
      .def(nb::init<nb::object, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>())
      .def("enqueue_closest", &ProbeStep::enqueue<Points>)
      .def("enqueue_rays", &ProbeStep::enqueue<Rays>)
      .def("report", &ProbeStep::report)
      .def("wait", &ProbeStep::wait, nb::arg().none());
}

}  // namespace tandem::python
