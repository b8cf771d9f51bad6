#include "contained.h"

#include <algorithm>
#include <new>

namespace tandem::bench {

void require(Status status) {
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw std::runtime_error(explain(status));
}

PlacedBodies::PlacedBodies(const LoadedScene& file) : assets(file.views()) {
  require(scene.set_assets(assets));
  require(scene.place(file.description.instances));
}

TimedContainments find_contained(const LoadedScene& scene, std::span<const ObjectPair> pairs,
                                 std::span<const TriangleContact> contacts, std::uint32_t threads,
                                 std::uint32_t repeats) {
  std::vector<Contact> sorted;
  sorted.reserve(contacts.size());
  for (const auto& [pair, a, b] : contacts) sorted.push_back({pair, a, b, 0, 0});
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Contact& x, const Contact& y) { return x.pair < y.pair; });
  PlacedBodies bodies(scene);
  require(bodies.scene.set_threads(threads));
  ContainmentQuery query;
  TimedContainments found;
  for (std::uint32_t i = 0; i < repeats; ++i) {
    Stopwatch watch;
    const Status status = query.find(bodies.scene, pairs, sorted);
    found.seconds.push_back(watch.lap());
    if (status == Status::kNoTopology)
      throw FileError(scene.name_of(bodies.scene.where()) + ": " + explain(status));
    require(status);
  }
  found.rows.assign(query.rows().begin(), query.rows().end());
  return found;
}

std::uint64_t count_inside(std::span<const Containment> rows) {
  return static_cast<std::uint64_t>(std::count_if(
      rows.begin(), rows.end(), [](const Containment& row) { return (row.flags & kInside) != 0; }));
}

}  // namespace tandem::bench
