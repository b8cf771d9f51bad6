#include "query.h"

namespace tandem::python {
namespace {

// Numbers of points or directions, (n, 3) float64; `count` becomes n.
const double* triples_of(const GivenArray& given, std::uint32_t& count) {
  given.require_type({kF64}, "float64");
  const std::vector<std::int64_t>& shape = given.shape();
  if (shape.size() != 2 || shape[1] != 3) given.wrong_shape("(n, 3)");
  if (shape[0] >= TANDEM_NO_INDEX) given.wrong_shape("fewer than 2^32 - 1 rows");
  count = static_cast<std::uint32_t>(shape[0]);
  return static_cast<const double*>(given.data());
}

template <typename Of>
constexpr std::size_t row_bytes() {
  return sizeof(*Of::rows(nullptr));
}

}  // namespace

Points::Points(nb::handle points, std::optional<double> reach, double absolute, double relative, bool sides,
               const Stream& stream, int device)
    : points_(points, "points", stream, device) {
  options_.points = triples_of(points_, options_.point_count);
  options_.limit_reach = reach.has_value();
  options_.reach = reach.value_or(0);
  options_.absolute_tolerance = absolute;
  options_.relative_tolerance = relative;
  options_.sides = sides;
}

Rays::Rays(nb::handle origins, nb::handle directions, std::optional<double> reach, std::uint32_t hits,
           const Stream& stream, int device)
    : origins_(origins, "origins", stream, device), directions_(directions, "directions", stream, device) {
  std::uint32_t count = 0;
  options_.origins = triples_of(origins_, options_.ray_count);
  options_.directions = triples_of(directions_, count);
  if (count != options_.ray_count) directions_.wrong_shape("that of origins");
  options_.hits = hits;
  options_.limit_reach = reach.has_value();
  options_.reach = reach.value_or(0);
}

template <typename Of>
Rows Query::probe(nb::object instances, const Of& probes, const Stream& stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(device());
  const Instances& bodies = bodies_of(instances, device());
  const auto query = probe_queries_.take(assets_, stream);
  const auto report =
      ProbeQueries::run(query, [&](tandem_gpu_probe_query* of) { return probes.find(of, bodies, stream); });
  return {memory_of(query, stream), Of::rows(query.get()), report.rows, row_bytes<Of>()};
}

template Rows Query::probe(nb::object, const Points&, const Stream&);
template Rows Query::probe(nb::object, const Rays&, const Stream&);

ProbeStep::ProbeStep(nb::object assets, std::uint32_t instances, std::uint32_t probes, std::uint32_t hits,
                     std::uint32_t words)
    : QueuedCalls(assets), hit_room_(hits) {
  const OnDevice current(assets_.device());
  query_ = ProbeQueries::make(assets_, Stream());
  static_cast<void>(assets_.zeros(instances));  // so that nothing need be made in a capture
  const tandem_gpu_probe_capacity room = {instances, probes, hits, words};
  check_whole(tandem_gpu_probe_query_reserve(query_.get(), &room));
}

template <typename Of>
Rows ProbeStep::enqueue(nb::object instances, nb::object given, const Stream& stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(assets_.device());
  const Instances& bodies = bodies_of(instances, assets_.device());
  const Of& probes = nb::cast<const Of&>(given);
  begin(stream);
  check_whole(probes.enqueue(query_.get(), bodies, stream));
  instances_ = instances;
  probes_ = given;
  return {memory_of(query_), Of::rows(query_.get()), probes.row_room(hit_room_), row_bytes<Of>()};
}

template Rows ProbeStep::enqueue<Points>(nb::object, nb::object, const Stream&);
template Rows ProbeStep::enqueue<Rays>(nb::object, nb::object, const Stream&);

Rows ProbeStep::report() const {
  return {memory_of(query_), tandem_gpu_probe_query_device_report(query_.get()), 1,
          sizeof(tandem_gpu_probe_report)};
}

nb::tuple ProbeStep::wait(const Stream* stream) {
  const Turn turn(busy_, kBusy);
  const OnDevice current(assets_.device());
  synchronize(stream);
  const auto report = checked_report(tandem_gpu_probe_query_get_report, query_.get());
  const tandem_gpu_probe_capacity& needed = report.needed;
  return nb::make_tuple(report.complete != 0, report.rows, needed.hits, needed.words);
}

}  // namespace tandem::python
