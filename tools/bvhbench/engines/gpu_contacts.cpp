#include "gpu_contacts.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace tandem {
namespace {

void put(std::span<const Contact> contacts, std::vector<TriangleContact>& into) {
  into.resize(contacts.size());
  std::transform(contacts.begin(), contacts.end(), into.begin(), [](const Contact& c) {
    return TriangleContact{c.pair, c.triangle_a, c.triangle_b};
  });
}

// Manifolds are made of contacts that are grouped.
OrderOnGpu order_of_query(const TimedQuery& asked) {
  return asked.manifolds && asked.order == OrderOnGpu::any ? OrderOnGpu::grouped : asked.order;
}

// Checks the order of what the GPU was to group or sort.
void check_order(const std::vector<Contact>& contacts, OrderOnGpu order) {
  if (order == OrderOnGpu::any) return;
  const auto key = [](const Contact& c) {
    return std::tie(c.pair, c.face_a, c.face_b, c.triangle_a, c.triangle_b);
  };
  const auto after = [&](const Contact& x, const Contact& y) {
    return order == OrderOnGpu::sorted ? key(x) >= key(y) : x.pair > y.pair;
  };
  if (std::adjacent_find(contacts.begin(), contacts.end(), after) == contacts.end()) return;
  throw std::runtime_error("the GPU: its contacts are not in order");
}

// Manifolds by their new rows, and their points with them. Within a pair they stay as they are.
void sort_manifolds(const std::vector<std::uint32_t>& row, TimedManifolds& made) {
  for (Manifold& manifold : made.manifolds) manifold.pair = row[manifold.pair];
  std::stable_sort(made.manifolds.begin(), made.manifolds.end(),
                   [](const Manifold& x, const Manifold& y) { return x.pair < y.pair; });
  const std::vector<ManifoldPoint> points = std::move(made.points);
  made.points.clear();
  for (std::uint32_t i = 0; i < made.manifolds.size(); ++i) {
    Manifold& manifold = made.manifolds[i];
    const auto first = points.begin() + manifold.first_point;
    manifold.first_point = static_cast<std::uint32_t>(made.points.size());
    made.points.insert(made.points.end(), first, first + manifold.point_count);
    for (std::uint32_t k = manifold.first_point; k < made.points.size(); ++k) made.points[k].manifold = i;
  }
}

// Brings the pairs into ascending order, and the contacts' rows with them.
void sort_pairs(TimedAnswer& answer) {
  const std::vector<ObjectPair> pairs = std::move(answer.pairs);
  std::vector<std::uint32_t> order(pairs.size()), row(pairs.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](auto x, auto y) { return pairs[x] < pairs[y]; });
  answer.pairs.clear();
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    row[order[i]] = i;
    answer.pairs.push_back(pairs[order[i]]);
  }
  for (TriangleContact& contact : answer.contacts) contact.pair = row[contact.pair];
  sort_manifolds(row, answer.manifolds);
}

}  // namespace

// Pairs that find_pairs() found, all of them, lie on the GPU already. ask() waits for the copy of others.
void GpuContactEngine::query(std::span<const ObjectPair> pairs) {
  ask(are_on_gpu(pairs) ? pairs_found() : upload(pairs), OrderOnGpu::any);
}

bool GpuContactEngine::contacts(std::vector<TriangleContact>& found_contacts) {
  const GpuContacts on_gpu = found();
  check(contacts_.grow(on_gpu.count), "download");
  const std::span<Contact> contacts(contacts_.data(), on_gpu.count);
  check(download(on_gpu.data, contacts, stream()), "download");
  put(contacts, found_contacts);
  return true;
}

TimedAnswer GpuContactEngine::time_query(const TimedQuery& asked) {
  if (asked.given == nullptr) keep_fixed();
  const GpuPairs pairs = pairs_of(asked, asked.order == OrderOnGpu::sorted);
  ask(pairs, order_of_query(asked));
  TimedAnswer answer;
  time_answer(pairs, asked, answer);
  const GpuContacts contacts = found();
  answer.gpu = use(asked, query_bytes(), most_bytes_of(asked));
  answer.pairs.resize(asked.given == nullptr ? count_found() : pairs.capacity);
  if (asked.manifolds) take_manifolds(answer.manifolds);
  take(pairs, contacts, asked.order, answer);
  if (asked.traversal) answer.traversal = time_walk(pairs, asked.repeats);
  if (asked.kept_within) time_kept(pairs, asked, answer);
  return answer;
}

// The bodies stand still, so what is kept is what was found.
void GpuContactEngine::time_kept(const GpuPairs& pairs, const TimedQuery& asked, TimedAnswer& answer) {
  const Before find_pairs = [&](unsigned) {
    if (asked.given == nullptr) enqueue_broad_phase(asked.order == OrderOnGpu::sorted);
  };
  const std::function<void()> run = repeatable_with_kept_manifolds(pairs, *asked.kept_within, find_pairs);
  answer.manifolds.kept = time_repeats(asked.repeats, run);
  TimedAnswer kept;
  kept.pairs.resize(answer.pairs.size());
  check(download(pairs.pairs, std::span(kept.pairs), stream()), "download");
  take_manifolds(kept.manifolds);
  sort_pairs(kept);
  answer.manifolds.kept_pairs = kept.manifolds.kept_pairs;
  check_kept(kept.manifolds.manifolds, kept.manifolds.points, answer.manifolds);
}

void GpuContactEngine::time_answer(const GpuPairs& pairs, const TimedQuery& asked, TimedAnswer& answer) {
  GpuEvent begin, between, found, end;
  for (GpuEvent* event : {&begin, &between, &found, &end}) check(event->create(), "an event");
  const bool finds_pairs = asked.given == nullptr;
  const Before find_pairs = [&](unsigned) {
    if (finds_pairs) enqueue_broad_phase(asked.order == OrderOnGpu::sorted);
  };
  const Before find_and_record = [&](unsigned event_flags) {
    find_pairs(event_flags);
    check(between.record(stream(), event_flags), "an event");
  };
  const Before then = [&](unsigned event_flags) { check(found.record(stream(), event_flags), "an event"); };
  // An event between the steps keeps the second from getting ready while the first ends.
  const std::function<void()> run = asked.manifolds
                                        ? repeatable_with_manifolds(pairs, asked.order, find_pairs, then)
                                        : repeatable(pairs, asked.order, find_pairs),
                              run_in_steps = repeatable(pairs, order_of_query(asked), find_and_record);
  const GpuEvent& end_of_query = asked.manifolds ? found : end;
  for (std::uint32_t i = 0; i < asked.repeats; ++i) {
    if (finds_pairs) {
      run_between(begin, run_in_steps, end);
      answer.narrow.push_back(seconds_between(between, end));
      answer.broad_phase.push_back(seconds_between(begin, between));
    }
    // The last, so that what is there afterwards, manifolds too, is of the same pairs.
    run_between(begin, run, end);
    answer.whole.push_back(seconds_between(begin, end_of_query));
    if (asked.manifolds) answer.manifolds.seconds.push_back(seconds_between(found, end));
    if (!finds_pairs) answer.narrow.push_back(answer.whole.back());
  }
}

void GpuContactEngine::take(const GpuPairs& pairs, const GpuContacts& contacts, OrderOnGpu order,
                            TimedAnswer& answer) const {
  std::vector<Contact> found(contacts.count);
  check(download(contacts.data, std::span(found), stream()), "download");
  check_order(found, order);
  put(found, answer.contacts);
  check(download(pairs.pairs, std::span(answer.pairs), stream()), "download");
  sort_pairs(answer);
}

std::size_t GpuContactEngine::most_bytes_of(const TimedQuery& asked) const {
  const std::size_t most = most_bytes(asked.order);
  if (most == 0 || asked.given != nullptr) return most;
  return most + most_broad_phase_bytes(broad_phase().capacity(), asked.order == OrderOnGpu::sorted);
}

}  // namespace tandem
